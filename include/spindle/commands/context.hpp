#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "spindle/commands/companions.hpp"
#include "spindle/commands/supervision.hpp"
#include "spindle/report/progress.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/report/streams.hpp"
#include "spindle/sim/serve.hpp"
#include "spindle/work/environment.hpp"
#include "spindle/work/target.hpp"

namespace spindle::commands {

// The words of the layer below are used here as if they were its own.
using namespace work;

/// Whether a question may be asked before something is changed.
enum class Consent : std::uint8_t {
  ask,       ///< on a terminal; refused elsewhere
  given,     ///< --yes
  no_input,  ///< --no-input: never ask, so refuse
};

/// Whether every frame stands on stderr (--verbose), which leaves no room for progress.
enum class Frames : std::uint8_t { hidden, shown };

/// Whether the user named a tool, or the default one is meant: what changes it is asked about then.
enum class TargetChoice : std::uint8_t { typed, by_default };

/// A word that is the name of a tool, and may be that of a parameter or action, too.
struct DoubtfulWord {
  std::string word;
  std::string profile = {};  ///< whose parameter it may be; empty: of the tools that are meant
};

/// The options that every command takes about what is said and asked.
struct UserOptions {
  Consent consent = Consent::ask;
  report::Verbosity verbosity = report::Verbosity::normal;
  Frames frames = Frames::hidden;
  report::Format format = report::Format::table;  ///< what the renderer draws
  /// Not on a terminal that cannot draw over a line, and not where there is one for all tools.
  report::Showing progress = report::Showing::wanted;
  TargetChoice choice = TargetChoice::typed;
  std::vector<DoubtfulWord> doubtful = {};
};

/// The part of a context that is the same for all tools, beside what work on them needs.
struct Surroundings {
  report::Streams& io;
  const sim::Serve& serve;
  const std::function<void()>& end_waits;  ///< ends every wait of every thread, as a signal would
  const Companions& companions;
  UserOptions user = {};
  Supervision supervision = {};
  std::string new_tools_file = {};  ///< where one is made if there is none; empty: nowhere is known
};

/// The part of a context that differs from one tool of a group to the next.
struct Telling {
  report::Renderer& renderer;
  const Target* about = nullptr;  ///< whose the errors are that are told; null: they say it
};

/// Everything a command may touch.
struct Context : work::Environment, Surroundings, Telling {};

/// The same context with a clock and lines that signals do not end.
Context uninterruptible_context(const Context& context);

/// The same context with another renderer, which must outlive it.
Context with_renderer(const Context& context, report::Renderer& renderer);

/// The same context, in which errors that are told are those of this tool, which must outlive it.
Context about(const Context& context, const Target& target);

/// The same context with other lines, which must outlive it.
Context with_lines(const Context& context, const device::OpenTransport& open);

/// How a command that handled several things ended.
class Outcome {
 public:
  void succeed() { ++succeeded_; }
  void fail(const Error& error);
  /// Done, and the answer is no (status 1), unless something failed.
  void negate() { negative_ = true; }
  /// All that happened elsewhere happened here, too.
  void add(const Outcome& other);

  /// ok; the common status of all failures when nothing succeeded; else partial. Interruptions win.
  [[nodiscard]] ExitStatus status() const;
  [[nodiscard]] std::size_t succeeded() const { return succeeded_; }
  [[nodiscard]] std::size_t failed() const { return failed_; }

 private:
  void note_failures(std::size_t count, ExitStatus status);

  std::size_t succeeded_ = 0;
  std::size_t failed_ = 0;
  bool negative_ = false;
  ExitStatus first_ = ExitStatus::ok;
  bool mixed_ = false;
};

}  // namespace spindle::commands
