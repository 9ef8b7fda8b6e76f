#include "spindle/files/change_log.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

namespace spindle::files {
namespace {

constexpr std::string_view null = "null";

/// Ill-formed text must not keep a change from being recorded.
std::string quoted(const std::string& text) {
  constexpr int compact = -1;
  constexpr char no_indentation = ' ';
  return nlohmann::json(text).dump(compact, no_indentation, false,
                                   nlohmann::json::error_handler_t::replace);
}

std::string text_or_null(const std::string& text) {
  return text.empty() ? std::string(null) : quoted(text);
}

std::string number_or_null(const std::optional<Decimal>& number) {
  return number ? number->to_string() : std::string(null);
}

using Json = nlohmann::json;

std::string text_at(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Numbers go through their text: a double would not be exact.
std::optional<Decimal> decimal_at(const Json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_number()) return std::nullopt;
  return Decimal::parse(found->dump());
}

/// Empty for what is no record of a change.
std::optional<Change> parse_change(std::string_view line) {
  const Json object = Json::parse(line, nullptr, false);
  if (!object.is_object() || text_at(object, "type") != "changed") return std::nullopt;
  Change change{.time = text_at(object, "time"),
                .user = text_at(object, "user"),
                .command = text_at(object, "command"),
                .target = text_at(object, "target"),
                .serial = text_at(object, "serial"),
                .name = text_at(object, "name"),
                .old_value = decimal_at(object, "old"),
                .new_value = decimal_at(object, "new"),
                .result = text_at(object, "result"),
                .id = text_at(object, "id")};
  const auto address = object.find("register");
  if (address != object.end() && address->is_number_unsigned()) {
    change.register_address = address->get<std::uint16_t>();
  }
  if (change.name.empty() || change.result.empty()) return std::nullopt;
  return change;
}

}  // namespace

std::string render_change(const Change& change) {
  return fmt::format(
      "{{\"schema\":\"spindle/1\",\"type\":\"changed\",\"time\":{},\"user\":{},\"command\":{},"
      "\"target\":{},\"serial\":{},\"name\":{},\"register\":{},\"old\":{},\"new\":{},"
      "\"result\":{},\"id\":{}}}\n",
      quoted(change.time), quoted(change.user), quoted(change.command), quoted(change.target),
      text_or_null(change.serial), quoted(change.name),
      change.register_address ? std::to_string(*change.register_address) : std::string(null),
      number_or_null(change.old_value), number_or_null(change.new_value), quoted(change.result),
      text_or_null(change.id));
}

ChangeRecords read_changes(std::string_view text) {
  ChangeRecords records;
  std::size_t number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    if (line.empty()) continue;
    if (auto change = parse_change(line)) {
      records.changes.push_back(std::move(*change));
    } else {
      records.broken.push_back(number);
    }
  }
  return records;
}

std::vector<Change> without_result(const std::vector<Change>& changes) {
  const auto key = [](const Change& change) {
    return std::tie(change.id, change.target, change.name);
  };
  std::vector<Change> open;
  for (const Change& change : changes) {
    if (change.id.empty()) continue;
    if (change.result == begun) {
      open.push_back(change);
    } else {
      std::erase_if(open, [&](const Change& other) { return key(other) == key(change); });
    }
  }
  return open;
}

}  // namespace spindle::files
