#include "stored_choice.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "spindle/base/local_time.hpp"
#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

Result<std::optional<WallTime>> time_of(std::string_view option, const std::string& text,
                                        const Clock& clock) {
  if (text.empty()) return std::nullopt;
  auto time = parse_time(text, clock);
  if (time) return *time;
  time.error().name = option;
  return tl::unexpected(std::move(time.error()));
}

}  // namespace

Error bad_option(std::string_view option, std::string message, std::string hint) {
  Error error{.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
  error.name = option;
  return error;
}

Result<void> add_times(const std::string& since, const std::string& until, const Clock& clock,
                       store::Filter& filter) {
  TRY_LET(filter.since, time_of("--since", since, clock));
  TRY_LET(filter.until, time_of("--until", until, clock));
  if (filter.since && filter.until && *filter.since >= *filter.until) {
    return tl::unexpected(bad_option("--until", "this is not behind --since", "swap the two"));
  }
  return {};
}

Error unknown_in_store(const std::string& text, std::vector<std::string> known) {
  std::string hint = suggestion(text, known);
  if (hint.empty() && !known.empty()) {
    constexpr std::size_t most = 5;
    const bool is_cut = known.size() > most;
    known.resize(std::min(known.size(), most));
    hint = fmt::format("known are {}{}", fmt::join(known, ", "), is_cut ? ", ..." : "");
  }
  return {.code = Errc::unknown_name,
          .message = fmt::format("the store knows no '{}'", text),
          .hint = std::move(hint)};
}

}  // namespace spindle::commands
