#include "spindle/files/change_log.hpp"

#include <fmt/format.h>

#include "spindle/base/json.hpp"

namespace spindle::files {
namespace {

constexpr std::string_view null = "null";

std::string quoted(std::string_view text) {
  std::string out;
  append_json_string(out, text);
  return out;
}

std::string text_or_null(const std::string& text) {
  return text.empty() ? std::string(null) : quoted(text);
}

std::string value_or_null(const std::optional<LoggedValue>& value) {
  if (!value) return std::string(null);
  const auto* number = std::get_if<Decimal>(&*value);
  return number != nullptr ? number->to_string() : quoted(std::get<std::string>(*value));
}

/// A key that stands only where there is something to say.
std::string key_if(std::string_view key, const std::string& text) {
  return text.empty() ? std::string() : fmt::format(",\"{}\":{}", key, quoted(text));
}

}  // namespace

std::string render_change(const Change& change) {
  return fmt::format(
      "{{\"schema\":\"spindle/1\",\"type\":\"changed\",\"time\":{},\"user\":{},\"command\":{},"
      "\"target\":{},\"serial\":{},\"name\":{},\"register\":{},\"old\":{},\"new\":{},"
      "\"result\":{},\"id\":{},\"unit\":{}{}{}{}}}\n",
      quoted(change.time), quoted(change.user), quoted(change.command), quoted(change.target),
      text_or_null(change.serial), quoted(change.name),
      change.register_address ? std::to_string(*change.register_address) : std::string(null),
      value_or_null(change.old_value), value_or_null(change.new_value), quoted(change.result),
      text_or_null(change.id), text_or_null(change.unit), key_if("old_label", change.old_label),
      key_if("new_label", change.new_label), key_if("undoes", change.undoes));
}

}  // namespace spindle::files
