#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/disk.hpp"
#include "spindle/base/interrupt.hpp"
#include "spindle/device/device.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/files/tools_file.hpp"
#include "spindle/report/progress.hpp"
#include "spindle/report/renderer.hpp"
#include "spindle/report/streams.hpp"
#include "spindle/sim/serve.hpp"

namespace spindle::commands {

struct Target;

/// Whether a question may be asked before something is changed.
enum class Consent : std::uint8_t {
  ask,       ///< on a terminal; refused elsewhere
  given,     ///< --yes
  no_input,  ///< --no-input: never ask, so refuse
};

/// Whom a command means: one tool, or everybody on its serial line.
enum class Reach : std::uint8_t { one, everybody };

enum class Verbosity : std::uint8_t { normal, frames };

/// The options that every command takes (contract, section 2.2), as far as commands see them.
struct CommonOptions {
  std::string profile = {};     ///< --profile; empty: not given
  std::string tools_file = {};  ///< --tools; empty: looked for
  std::optional<Duration> timeout = std::nullopt;
  std::optional<Duration> connect_timeout = std::nullopt;
  std::optional<unsigned> retries = std::nullopt;
  Consent consent = Consent::ask;
  Verbosity verbosity = Verbosity::normal;
  std::string trace_file = {};  ///< --trace; empty: no capture
  /// Not with --quiet, not beside frames, not on a terminal that can not draw over a line.
  report::Showing progress = report::Showing::wanted;
};

/// A line and a clock that signals do not end: for the last words that leave a tool safe.
struct Calm {
  Clock& clock;
  const Interrupt& interrupt;  ///< never raised
  device::OpenTransport open;
  /// From now on a request to suspend the program (Ctrl-Z) ends it as Ctrl-C does: a suspended
  /// program stops no motor. May be empty.
  std::function<void()> stay_awake = {};
  /// What is told when a second signal ends the program at once; empty: nothing. May be empty.
  std::function<void(std::string_view words)> set_last_words = {};
  /// Starts a second process that does `when_orphaned`, and tells what it returns, when this
  /// program ends, however it ends, without having called the function that is returned. May be
  /// empty.
  std::function<Result<std::function<void()>>(std::function<std::string()> when_orphaned)>
      start_guardian = {};
};

/// The part of a context that signals end.
struct Waiting {
  Clock& clock;
  const Interrupt& interrupt;
  const device::OpenTransport& open;  ///< real lines; simulated tools are opened by commands
};

/// The part of a context that signals leave alone.
struct Surroundings {
  report::Streams& io;
  const Calm& calm;
  const sim::Serve& serve;
  const std::function<void()>& end_waits;  ///< ends every wait of every thread, as a signal would
  const Disk& disk;
  const std::string& state_folder;  ///< where records of changes are kept; empty: nowhere is known
  std::string_view version;         ///< of spindle
  const files::ProfileStore& profiles;
  const files::Tools& tools;
  CommonOptions common;
};

/// The part of a context that differs from one tool of a group to the next.
struct Telling {
  report::Renderer& renderer;
  const Target* about = nullptr;  ///< whose the errors are that are told; null: they say it
};

/// Everything a command may touch.
struct Context : Waiting, Surroundings, Telling {};

/// The same context with a clock and lines that signals do not end.
Context calm_context(const Context& context);

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
