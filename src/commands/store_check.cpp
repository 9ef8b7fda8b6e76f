#include <fmt/format.h>

#include <array>
#include <set>
#include <utility>

#include "listing.hpp"
#include "odometer.hpp"
#include "records.hpp"
#include "result_selection.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "stored_records.hpp"
#include "time_field.hpp"

namespace spindle::commands {
namespace {

using report::Align;
using report::Record;

const std::array<report::Column, 9> coverage_columns = {
    {{"TARGET", "target"},
     {"SERIAL", "serial"},
     {"EPOCH", "epoch", Align::right, 0, report::left_out(1)},
     {"FIRST", "first", Align::right},
     {"LAST", "last", Align::right},
     {"ROWS", "rows", Align::right},
     {"IN GAPS", "in_gaps", Align::right},
     {"HOLES", "holes", Align::right},
     {"NUMBERS", "verdict"}}};

const std::array<report::Column, 7> odometer_columns = {
    {{"TARGET", "target"},
     {"SERIAL", "serial"},
     {"SINCE", "since", Align::left, 0, report::wrapped(10)},
     {"UNTIL", "until", Align::left, 0, report::wrapped(10)},
     {"COUNTED BY TOOL", "counted", Align::right},
     {"STORED", "stored", Align::right},
     {"FASTENINGS", "verdict"}}};

const std::array<report::Column, 1> damage_columns = {{{"DAMAGE", "message"}}};

/// Sums over all tools and epochs.
struct Sums {
  std::set<store::RowId> tools = {};
  std::size_t rows = 0;
  std::size_t in_gaps = 0;
  std::size_t holes = 0;
  std::size_t unknown_gaps = 0;
  std::size_t damages = 0;

  void add(const store::Coverage& coverage) {
    tools.insert(coverage.tool);
    rows += coverage.rows;
    in_gaps += coverage.in_gaps;
    holes += coverage.holes;
    unknown_gaps += coverage.unknown_gaps;
  }
};

class StoreCheck {
 public:
  StoreCheck(store::Reader& reader, const StoredRecords& records, Context& context)
      : reader_(&reader), records_(&records), context_(&context) {}

  Result<Outcome> run() {
    return tell_damages()
        .and_then([this] { return tell_coverage(); })
        .and_then([this] { return tell_mileage(); })
        .and_then([this] { return tell_sums(); })
        .map([this] { return outcome_; });
  }

 private:
  Result<void> tell_damages() {
    TRY_LET(const auto findings, reader_->integrity());
    sums_.damages = findings.size();
    Listing listing(*context_, damage_columns);
    for (const std::string& finding : findings) {
      listing.add(Record{.type = "damage",
                         .target = {},
                         .time = context_->clock.wall(),
                         .fields = {{"message", finding}}});
    }
    return listing.end();
  }

  Result<void> tell_coverage() {
    TRY_LET(const auto all, reader_->coverage());
    Listing listing(*context_, coverage_columns);
    for (const store::Coverage& coverage : all) {
      sums_.add(coverage);
      listing.add(coverage_record(coverage));
    }
    return listing.end();
  }

  Result<void> tell_mileage() {
    TRY_LET(const auto all, read_mileage(*reader_));
    if (all.empty()) return {};
    Listing listing(*context_, odometer_columns);
    for (const Mileage& mileage : all) listing.add(odometer_record(mileage));
    return listing.end();
  }

  Result<void> tell_sums() {
    const Sums& sums = sums_;
    if (sums.holes > 0 || sums.damages > 0) outcome_.negate();
    std::string sentence = fmt::format(
        "{}, {}, {} in gaps, {}, ", counted(sums.tools.size(), "tool"), counted(sums.rows, "row"),
        counted(sums.in_gaps, "number"), counted(sums.holes, "hole"));
    if (sums.unknown_gaps > 0) {
      sentence += fmt::format("{} of unknown size, ", counted(sums.unknown_gaps, "gap"));
    }
    sentence += sums.damages == 0 ? "the store is whole" : counted(sums.damages, "damage");
    return tell({.counts = {{"tools", count(sums.tools.size())},
                            {"rows", count(sums.rows)},
                            {"in_gaps", count(sums.in_gaps)},
                            {"holes", count(sums.holes)},
                            {"unknown_gaps", count(sums.unknown_gaps)},
                            {"damages", count(sums.damages)}},
                 .sentence = sentence},
                outcome_, *context_);
  }

  /// A record about a tool, under its last name.
  [[nodiscard]] Record record_of(std::string type, store::RowId id) const {
    const store::Place* place = records_->place_at(id, context_->clock.wall());
    const store::Tool* tool = records_->tool(id);
    Record record{.type = std::move(type),
                  .target = place == nullptr ? std::string() : place->name,
                  .time = context_->clock.wall(),
                  .fields = {}};
    record.fields.push_back(
        {"serial", text_or_null(tool == nullptr ? std::string() : tool->name.serial)});
    return record;
  }

  [[nodiscard]] Record coverage_record(const store::Coverage& coverage) const {
    Record record = record_of("coverage", coverage.tool);
    std::string verdict = "complete";
    if (coverage.unknown_gaps > 0) {
      verdict =
          fmt::format("cannot tell: {} of unknown size", counted(coverage.unknown_gaps, "gap"));
    }
    if (coverage.holes > 0) verdict = fmt::format("{} missing", coverage.holes);
    record.fields.insert(record.fields.end(), {{"epoch", number(coverage.epoch)},
                                               {"first", number(coverage.first)},
                                               {"last", number(coverage.last)},
                                               {"rows", count(coverage.rows)},
                                               {"in_gaps", count(coverage.in_gaps)},
                                               {"holes", count(coverage.holes)},
                                               {"unknown_gaps", count(coverage.unknown_gaps)},
                                               {"verdict", std::move(verdict)}});
    return record;
  }

  [[nodiscard]] Record odometer_record(const Mileage& mileage) const {
    Record record = record_of("odometer", mileage.tool);
    const auto missing = mileage.missing();
    std::string verdict = "cannot tell: the tool's total was set back or counts something else";
    if (missing) verdict = *missing == 0 ? "complete" : fmt::format("{} missing", *missing);
    record.fields.insert(record.fields.end(),
                         {time_field("since", mileage.since, *context_),
                          time_field("until", mileage.until, *context_),
                          {"counted", number(mileage.counted)},
                          {"stored", number(mileage.stored)},
                          {"missing", missing ? number(*missing) : report::Cell()},
                          {"verdict", std::move(verdict)}});
    return record;
  }

  store::Reader* reader_;
  const StoredRecords* records_;
  Context* context_;
  Sums sums_ = {};
  Outcome outcome_ = {};
};

}  // namespace

Result<Outcome> check_store(const StoreOptions& options, Context& context) {
  TRY_LET(auto reader, open_store(options.store, context));
  ProfileShelf shelf(context.profiles);
  TRY_LET(const auto records, StoredRecords::make(*reader, shelf, context));
  return StoreCheck(*reader, records, context).run();
}

}  // namespace spindle::commands
