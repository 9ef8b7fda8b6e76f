#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "listing.hpp"
#include "patient_out.hpp"
#include "progress.hpp"
#include "spindle/commands/context.hpp"
#include "spindle/work/run.hpp"

namespace spindle::commands {

/// What a user sees of a run: what happens on the way, the one changing line on a terminal, and at
/// the end its errors, what is not as it was found, and the summary.
class RunOutput final : public work::RunObserver {
 public:
  /// All must outlive it.
  RunOutput(std::span<const report::Column> columns, const OpenTool& tool, Context& context,
            const work::ChangeLog& log, const std::function<void()>& when_prepared)
      : columns_(columns),
        tool_(&tool),
        log_(&log),
        context_(&context),
        when_prepared_(&when_prepared),
        progress_(context) {}

  void on_prepared() override {
    listing_.emplace(*context_, columns_);
    (*when_prepared_)();
  }
  void on_start() override { out_.emplace(context_->io, context_->interrupt); }
  void on_lost_link() override { progress_.show("the link is lost; trying to stop the tool"); }
  /// Not before the stop: a terminal may keep its writer waiting.
  void on_stopped() override { progress_.clear(); }
  void note(const std::string& sentence) override { context_->renderer.note(sentence); }

  /// What happened to the tool. Requires that it was prepared.
  void add(const report::Record& record) { listing_->add(record); }

  /// Error `closed_pipe` when the output has no reader any more.
  [[nodiscard]] Result<void> check_reader() const;

  /// On a terminal, while something goes on.
  void show_running(Duration elapsed, std::string_view more = {});

  /// Remembers an error for the end; it also makes the outcome.
  void fail(const Error& error);
  /// What ended the following of a run.
  void fail_following(const Error& error);

  [[nodiscard]] Outcome& outcome() { return outcome_; }

  /// Ends the list of what happened; then come the errors and the summary.
  Result<Outcome> end(const work::RunReport& report);

 private:
  /// A stop that could not be confirmed: nothing else matters as much.
  void fail(const device::StopReport& unconfirmed);
  /// Each on its own: they reach people even where the records have no reader any more.
  Result<void> tell_errors();
  void tell_left(const std::vector<work::Left>& left) const;
  /// Waits until what was told is taken.
  Result<void> drain();
  [[nodiscard]] Result<Outcome> ended_with(const Result<void>& written) const;
  Result<void> summarise(const work::RunReport& report);

  std::span<const report::Column> columns_;
  const OpenTool* tool_;
  const work::ChangeLog* log_;
  Context* context_;
  const std::function<void()>* when_prepared_;
  ProgressLine progress_;
  std::optional<Listing> listing_ = std::nullopt;
  /// From the start on: a motor must not run on because its reader is slow.
  std::optional<PatientOut> out_ = std::nullopt;
  Outcome outcome_ = {};
  std::vector<Error> errors_ = {};
};

}  // namespace spindle::commands
