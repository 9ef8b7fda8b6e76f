#include "spindle/catalogue/meaning.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace spindle::catalogue {
namespace {

/// "start" is none of the bits of a register now.
Error does_not_count(const Parameter& parameter, std::string_view decider, const Value& value) {
  std::vector<std::string> names;
  for (const BitName& bit : parameter.bits) names.push_back(bit.text);
  const std::string number =
      value.label.empty() || !value.is_number() ? "" : fmt::format(" ({})", value.exact());
  return {.code = Errc::usage,
          .message = fmt::format("it has no bit '{}' while {} is {}{}", parameter.part, decider,
                                 value.to_string(), number),
          .hint = names.empty() ? std::string("none of its bits has a name now")
                                : fmt::format("it has {} now", fmt::join(names, ", ")),
          .name = parameter.name};
}

Result<Parameter> with_names(const Parameter& parameter, const ValueOf& value_of) {
  const auto value = value_of(parameter.bits_by);
  const bool is_needed = !parameter.part.empty();
  if (is_needed && !value) return tl::unexpected(value.error());
  std::optional<std::int64_t> number;
  if (value && value->is_number()) number = value->number.mantissa();
  Parameter meant = with_bits_for(parameter, number);
  if (!meant.part.empty()) return tl::unexpected(does_not_count(meant, parameter.bits_by, *value));
  return meant;
}

Result<Parameter> with_scale(Parameter parameter, const ValueOf& value_of) {
  const std::string decider = parameter.scale_by;
  TRY_LET(const auto value, value_of(decider));
  if (const auto power = power_of(value)) return with_power(std::move(parameter), *power);
  return tl::unexpected(
      Error{.code = Errc::bad_value,
            .message = fmt::format("{} is no power of ten: {}", decider, value.to_string())});
}

}  // namespace

Result<Parameter> meant_by_others(const Parameter& parameter, const ValueOf& value_of) {
  auto meant =
      parameter.bits_by.empty() ? Result<Parameter>(parameter) : with_names(parameter, value_of);
  if (!meant || parameter.scale_by.empty()) return meant;
  return with_scale(*std::move(meant), value_of);
}

}  // namespace spindle::catalogue
