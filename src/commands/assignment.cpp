#include "assignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/base/byte_order_mark.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/short_name.hpp"
#include "spindle/catalogue/unit.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::Profile;

constexpr std::string_view percent = "%";

Error bad_step(const Parameter& parameter, std::string message, std::string hint) {
  return {.code = Errc::bad_value,
          .message = std::move(message),
          .hint = std::move(hint),
          .name = parameter.name,
          .register_address = parameter.address.value};
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view blanks = " \t\r";
  const std::size_t begin = std::min(text.find_first_not_of(blanks), text.size());
  return text.substr(begin, text.find_last_not_of(blanks) + 1 - begin);
}

/// Whether one number is what it holds, and no word stands for it.
bool is_plain_number(const Parameter& parameter, std::string_view text) {
  const bool is_number = parameter.encoding.is_integer() || parameter.encoding.is_float();
  const bool is_label = std::any_of(
      parameter.labels.begin(), parameter.labels.end(),
      [&](const catalogue::Label& label) { return same_ignoring_case(label.text, text); });
  return is_number && !is_label && parameter.bits.empty() && parameter.part.empty() &&
         parameter.encoding.count == 1;
}

/// "5%" and "2.5 %": the number in front.
std::optional<Decimal> percentage(std::string_view text) {
  if (!text.ends_with(percent)) return std::nullopt;
  text.remove_suffix(percent.size());
  return Decimal::parse(trimmed(text));
}

bool has_sign(std::string_view text) { return text.starts_with('+') || text.starts_with('-'); }

/// A difference of temperatures is no temperature: 5 degF more are not -15 degC more.
bool is_shifted(std::string_view text, const std::string& unit) {
  const std::size_t digits = text.find_first_not_of("0123456789.");
  if (digits == std::string_view::npos) return false;
  const auto nothing = catalogue::convert_typed("0" + std::string(text.substr(digits)), unit);
  return nothing && Decimal::parse(nothing->text) != Decimal(0);
}

/// So much in the unit of the parameter.
Result<Decimal> amount_of(const std::string& text, const Parameter& parameter,
                          const std::string& unit) {
  const auto refuse = [&](std::string hint) {
    return tl::unexpected(bad_step(
        parameter, fmt::format("'{}' is no step that can be added", text), std::move(hint)));
  };
  if (has_sign(text))
    return refuse("write += to add, -= to take away, and the step without a sign");
  if (is_shifted(text, unit)) return refuse(fmt::format("write it in {}", unit));
  TRY_LET(const auto converted, catalogue::convert_typed(text, unit));
  if (const auto number = Decimal::parse(converted.text)) return *number;
  return refuse("write a number, or a percentage of the value such as 5%");
}

Error of_value_or_unit(const Parameter& parameter, std::string_view typed) {
  return bad_step(parameter,
                  fmt::format("'{}' may be a part of the value, or of the unit %", typed),
                  "write =VALUE for a value, or += and -= with a number without % for a step");
}

Error of_value_or_step(const Parameter& parameter, std::string_view typed) {
  return bad_step(
      parameter, fmt::format("'{}' may be a value, or a step", typed),
      fmt::format("write ={0} for the value, or +={0} to add so much", typed.substr(1)));
}

}  // namespace

Result<TypedAssignment> take_apart(const std::string& text, const Profile& profile) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    Error error{.code = Errc::usage,
                .message = fmt::format("'{}' is not of the form NAME=VALUE", text),
                .hint = "write it like preset.1.target-torque=2.71"};
    const bool is_name = text.find_first_of(", \t") == std::string::npos;
    if (equals != 0 && is_name)
      error.remedy.right = fmt::format("spindle get TARGET {}", shell_word(text));
    return tl::unexpected(std::move(error));
  }
  TypedAssignment typed{.name = text.substr(0, equals), .value = text.substr(equals + 1)};
  const char last = typed.name.back();
  const bool is_step = (last == '+' || last == '-') && typed.name.size() > 1;
  if (!is_step || profile.find(typed.name)) return typed;
  typed.name.pop_back();
  typed.sign = last == '+' ? Sign::plus : Sign::minus;
  return typed;
}

Result<std::vector<Parameter>> parameters_to_set(const std::string& name, const Profile& profile) {
  if (name.front() != '@' && is_pattern(name)) {
    std::vector<Parameter> found;
    for (const Parameter& parameter : profile.parameters) {
      if (glob_match(name, parameter.name)) found.push_back(profile.marked(parameter));
    }
    if (!found.empty()) return found;
    return tl::unexpected(
        Error{.code = Errc::unknown_name,
              .message = fmt::format("matches no parameter of profile {}", profile.id),
              .name = name,
              .remedy = {.right = "spindle list TARGET"}});
  }
  TRY_LET(const auto whole, catalogue::one_meant_by(name, profile));
  TRY_LET(auto parameter, profile.find(whole));
  return std::vector<Parameter>{profile.marked(std::move(parameter))};
}

Result<std::optional<ValueStep>> step_of(const TypedAssignment& typed, const Parameter& parameter,
                                         const std::string& unit) {
  const bool is_number = is_plain_number(parameter, typed.value);
  const auto hundredths = percentage(typed.value);
  const bool is_signed_share = is_number && hundredths && has_sign(typed.value);
  if (!typed.sign && !is_signed_share) {
    const bool may_be_step = is_number && typed.value.starts_with('+');
    if (may_be_step) return tl::unexpected(of_value_or_step(parameter, typed.value));
    return std::nullopt;
  }
  if (parameter.secrecy == catalogue::Secrecy::secret) {
    return tl::unexpected(bad_step(parameter, "it is a secret, and the sum would show it",
                                   "write the new value behind ="));
  }
  if (!typed.sign) {
    if (unit == percent) return tl::unexpected(of_value_or_unit(parameter, typed.value));
    const Decimal amount = hundredths->sign() == Sign::minus ? hundredths->negated() : *hundredths;
    return ValueStep{.sign = hundredths->sign(), .amount = amount, .is_percent = true};
  }
  if (!is_number) {
    return tl::unexpected(bad_step(parameter, "it is no single number, so nothing can be added",
                                   "write the new value behind ="));
  }
  if (hundredths && !has_sign(typed.value)) {
    if (unit == percent) return tl::unexpected(of_value_or_unit(parameter, typed.value));
    return ValueStep{.sign = *typed.sign, .amount = *hundredths, .is_percent = true};
  }
  TRY_LET(const auto amount, amount_of(typed.value, parameter, unit));
  return ValueStep{.sign = *typed.sign, .amount = amount};
}

Result<Decimal> stepped(const catalogue::Value& before, const ValueStep& step) {
  if (!before.is_number()) {
    return tl::unexpected(Error{
        .code = Errc::bad_value,
        .message =
            fmt::format("the tool holds {}, which is no number to add to", before.to_string()),
        .hint = "write the new value behind ="});
  }
  const Decimal hundredth(1, -2);
  auto change = std::optional(step.amount);
  if (step.is_percent) {
    change = before.number.times(step.amount);
    if (change) change = change->times(hundredth);
  }
  if (change && step.sign == Sign::minus) change = change->negated();
  if (change) change = before.number.plus(*change);
  if (change) return *change;
  return tl::unexpected(Error{.code = Errc::bad_value,
                              .message = "the result has too many digits to be exact",
                              .hint = "write the new value behind ="});
}

std::string step_in_words(const catalogue::Value& before, const ValueStep& step,
                          const Decimal& result) {
  return fmt::format("{} {} {}{} is {}", before.number.to_string(),
                     step.sign == Sign::plus ? "+" : "-", step.amount.to_string(),
                     step.is_percent ? " %" : "", result.to_string());
}

std::vector<PlacedText> assignments_in(std::string_view text, const std::string& name) {
  std::vector<PlacedText> found;
  std::size_t number = 0;
  for (const std::string_view whole : split(text, '\n')) {
    ++number;
    const std::string_view line = trimmed(whole);
    if (line.empty() || line.front() == '#') continue;
    const std::size_t equals = line.find('=');
    std::string assignment(line);
    if (equals != std::string_view::npos) {
      std::string_view front = trimmed(line.substr(0, equals));
      const bool has_operator = front.ends_with('+') || front.ends_with('-');
      const std::string_view sign = has_operator ? front.substr(front.size() - 1) : "";
      if (has_operator) front = trimmed(front.substr(0, front.size() - 1));
      assignment = fmt::format("{}{}={}", front, sign, trimmed(line.substr(equals + 1)));
    }
    found.push_back({std::move(assignment), fmt::format("{}:{}", name, number)});
  }
  return found;
}

Result<std::vector<PlacedText>> texts_to_set(const SetOptions& options, const Context& context) {
  std::vector<PlacedText> texts;
  for (const std::string& text : options.assignments) texts.push_back({text});
  if (options.file.empty()) return texts;
  const bool is_stream = options.file == "-";
  std::string content;
  if (is_stream) {
    while (const auto line = context.io.read_line()) content += *line + "\n";
  } else {
    TRY_LET(content, context.disk.read(options.file));
  }
  if (content.starts_with(byte_order_mark)) content.erase(0, byte_order_mark.size());
  const std::string name = is_stream ? "standard input" : options.file;
  const auto lines = assignments_in(content, name);
  if (lines.empty()) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "no line of it sets anything",
                                .hint = "write NAME=VALUE, one a line",
                                .name = name});
  }
  texts.insert(texts.end(), lines.begin(), lines.end());
  return texts;
}

Error all_of(std::vector<Error> errors) {
  Error first = std::move(errors.front());
  for (std::size_t index = 1; index < errors.size(); ++index) {
    first.details.push_back(describe(errors[index]));
  }
  return first;
}

}  // namespace spindle::commands
