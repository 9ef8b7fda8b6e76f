#include "binder.hpp"

#include <fmt/ranges.h>

#include <algorithm>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"

namespace spindle::cli {

Error usage(std::string message, std::string hint) {
  return {.code = Errc::usage, .message = std::move(message), .hint = std::move(hint)};
}

Error for_help(std::string_view path, Error error) {
  error.remedy.right = fmt::format("spindle {} --help", path);
  error.hint = fmt::format("'{}' shows examples", error.remedy.right);
  return error;
}

Error bad_option(std::string_view option, std::string message, std::string hint) {
  Error error = usage(std::move(message), std::move(hint));
  error.code = Errc::bad_value;
  error.name = option;
  return error;
}

Result<std::uint64_t> NumberFrom::operator()(std::string_view option,
                                             const std::string& text) const {
  const auto number = parse_unsigned(text, maximum);
  if (number && *number >= minimum) return *number;
  return tl::unexpected(
      bad_option(option, fmt::format("'{}' does not fit", text),
                 fmt::format("it takes a number from {} to {}", minimum, maximum)));
}

Result<Duration> to_duration(std::string_view option, const std::string& text) {
  auto duration = parse_duration(text);
  if (duration && *duration > Duration::zero()) return *duration;
  const std::string_view why = duration ? "is too short" : "is not a duration";
  return tl::unexpected(
      bad_option(option, fmt::format("'{}' {}", text, why), "write it like 500ms, 2.5s or 5min"));
}

Result<std::vector<std::string>> to_columns(std::string_view option, const std::string& text) {
  std::vector<std::string> columns;
  for (const std::string_view word : split(text, ',')) {
    if (word.empty()) {
      return tl::unexpected(bad_option(option,
                                       fmt::format("'{}' has a column without a name", text),
                                       "write it like name,value,unit"));
    }
    columns.emplace_back(word);
  }
  return columns;
}

Result<std::vector<modbus::UnitId>> to_units(std::string_view option, const std::string& text) {
  constexpr std::uint64_t last_unit = 247;  // Modbus over Serial Line 1.02, 2.2
  std::vector<modbus::UnitId> units;
  for (const std::string_view range : split(text, ',')) {
    const auto dash = range.find('-');
    const auto first = parse_unsigned(range.substr(0, dash), last_unit);
    const auto last =
        dash == std::string_view::npos ? first : parse_unsigned(range.substr(dash + 1), last_unit);
    if (!first || !last || *first == 0 || *last < *first) {
      return tl::unexpected(bad_option(option, fmt::format("'{}' does not fit", text),
                                       "it takes units from 1 to 247, such as 1-31 or 1,5"));
    }
    for (std::uint64_t unit = *first; unit <= *last; ++unit) {
      const modbus::UnitId id{static_cast<std::uint8_t>(unit)};
      if (std::find(units.begin(), units.end(), id) == units.end()) units.push_back(id);
    }
  }
  return units;
}

Result<RegisterBounds> to_registers(std::string_view option, const std::string& text) {
  constexpr std::uint64_t last_register = 0xFFFF;
  constexpr std::string_view dots = "..";
  const std::string_view range = text;
  const auto at = range.find(dots);
  const bool is_one = at == std::string_view::npos;
  const auto from = parse_unsigned(range.substr(0, at), last_register);
  const auto to = is_one ? from : parse_unsigned(range.substr(at + dots.size()), last_register);
  if (from && to && *from <= *to) {
    return RegisterBounds{static_cast<std::uint16_t>(*from), static_cast<std::uint16_t>(*to)};
  }
  return tl::unexpected(bad_option(option, fmt::format("'{}' does not fit", text),
                                   "it takes registers from 0 to 65535, such as 0..999"));
}

Error unknown_choice(std::string_view option, const std::string& text,
                     const std::vector<std::string>& words) {
  std::string hint = fmt::format("it takes {}", fmt::join(words, ", "));
  if (const std::string meant = suggestion(text, words); !meant.empty()) hint += "; " + meant;
  Error error = bad_option(option, fmt::format("'{}' is unknown", text), std::move(hint));
  error.remedy = remedy_for(text, words);
  return error;
}

std::optional<Error> Faults::first() const {
  for (const Check& check : required) {
    if (auto error = check()) return error;
  }
  if (conversion) return conversion;
  for (const Check& check : checks) {
    if (auto error = check()) return error;
  }
  return std::nullopt;
}

Error Binder::missing(std::string_view path, std::string_view argument) {
  return for_help(path, usage(fmt::format("{}: {} is missing", path, argument)));
}

}  // namespace spindle::cli
