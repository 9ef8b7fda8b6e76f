#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>
#include <vector>

namespace spindle {

/// What the process returns (contract, section 4). The only numbers a user ever sees.
enum class ExitStatus : std::uint8_t {
  ok = 0,
  negative = 1,
  usage = 2,
  bad_file = 3,
  unreachable = 4,
  no_answer = 5,
  refused = 6,
  malformed = 7,
  mismatch = 8,
  partial = 9,
  internal = 70,
  storage = 74,
  interrupted = 130,
  terminated = 143,
};

/// Every way in which something can fail. Each belongs to one exit status.
enum class Errc : std::uint8_t {
  negative,
  usage,
  unknown_name,
  bad_value,
  out_of_range,
  read_only,
  not_confirmed,
  unverified,
  bad_file,
  bad_target,
  name_not_found,
  connection_refused,
  no_route,
  connect_timeout,
  port_missing,
  port_busy,
  port_unusable,
  no_answer,
  incomplete_answer,
  closed,
  reset,
  exception_response,
  malformed_answer,
  bad_checksum,
  local_echo,
  mismatch,
  wrong_generation,
  wrong_model,
  partial,
  internal,
  storage,
  interrupted,
  terminated,
  closed_pipe,
};

/// One row of the table of exit statuses; code, JSON and man page all use it.
struct StatusInfo {
  ExitStatus status;
  std::string_view name;     ///< snake_case, the `code` of a JSON error
  std::string_view meaning;  ///< one line for the manual
};

/// One row of the table of errors.
struct ErrcInfo {
  Errc code;
  ExitStatus status;
  /// The sentence used when an error brings no message of its own. `{tried}` and `{waited}` are
  /// replaced by the error's members.
  std::string_view text;
  std::string_view hint;  ///< the next step used when an error brings none; may be empty
  /// What can be pasted beside this hint, as Remedy::right; may be empty.
  std::string_view command = {};
};

std::span<const StatusInfo> status_table();
std::span<const ErrcInfo> errc_table();
const StatusInfo& info(ExitStatus status);
const ErrcInfo& info(Errc code);

/// A command line that may help, as it can be pasted: what was typed with one change, or another.
struct Remedy {
  /// The word that is replaced, alone, on one side of a '=' or behind a ':'; empty: none is.
  std::string wrong = {};
  /// In its place. Without `wrong` a whole command line; TARGET in it stands for the tool that the
  /// error is about. Empty: there is no remedy.
  std::string right = {};
};

/// The nearest of these words in place of a misspelt one (see closest()); where none is near, this
/// command line, which may be empty.
Remedy remedy_for(std::string_view word, const std::vector<std::string>& known,
                  std::string command = {});

/// The one error type. Carries what was tried; `describe()` is the only place that makes it text.
struct Error {
  Errc code = Errc::internal;
  std::string message = {};   ///< lower case, one line, no full stop; empty: the table's text
  std::string hint = {};      ///< what would help; empty: the table's hint
  std::string target = {};    ///< tool as the user named it
  std::string endpoint = {};  ///< where the target is, when that is not its name; empty: the same
  std::string asked_of = {};  ///< tool that it was wanted from, where the error is not about it
  std::string name = {};      ///< parameter, action, option or file that it is about
  std::string tried = {};     ///< operation under way, such as "report server id"
  std::optional<std::chrono::nanoseconds> waited = std::nullopt;
  std::optional<std::uint16_t> register_address = std::nullopt;
  std::optional<std::uint8_t> exception = std::nullopt;     ///< exception code as received
  std::optional<std::uint32_t> device_code = std::nullopt;  ///< why, in the device's own code
  Remedy remedy = {};
  std::vector<std::string> details = {};  ///< more of the same kind, a sentence each

  [[nodiscard]] ExitStatus status() const { return info(code).status; }
};

template <typename T>
using Result = tl::expected<T, Error>;

/// The sentence without target, name and hint.
std::string message_of(const Error& error);

/// The next step: the error's own or its table row's; may be empty.
std::string hint_of(const Error& error);

/// "target (endpoint): name: message", one line.
std::string cause_of(const Error& error);

/// The remedy as a command line for a shell, where `typed` are the words behind the program's name.
/// Empty where there is none, or where the word that is wrong does not stand in it.
std::string command_to_try(const Error& error, const std::vector<std::string>& typed);

/// "target (endpoint): name: message; hint", one line, as printed on stderr behind "spindle: ". A
/// target that is a URL itself is not told beside its endpoint.
std::string describe(const Error& error);

}  // namespace spindle

// Leaving a function with the error of what it asked for is said in one word.

#define SPINDLE_JOINED(a, b) a##b
#define SPINDLE_NAMED(a, b) SPINDLE_JOINED(a, b)
#define SPINDLE_TRY_LET(tried, declaration, ...)               \
  auto tried = (__VA_ARGS__);                                  \
  if (!tried) return tl::unexpected(std::move(tried).error()); \
  declaration = std::move(*tried)
#define SPINDLE_TRY(tried, ...)                        \
  do {                                                 \
    if (auto tried = (__VA_ARGS__); !tried) {          \
      return tl::unexpected(std::move(tried).error()); \
    }                                                  \
  } while (false)

/// `TRY(result);` returns from the function with the error of this Result, where it is one.
#define TRY(...) SPINDLE_TRY(SPINDLE_NAMED(tried_, __COUNTER__), __VA_ARGS__)

/// `TRY_LET(auto value, result);` the same, and declares what the Result holds otherwise.
#define TRY_LET(declaration, ...) \
  SPINDLE_TRY_LET(SPINDLE_NAMED(tried_, __COUNTER__), declaration, __VA_ARGS__)
