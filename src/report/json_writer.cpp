#include "json_writer.hpp"

#include <fmt/format.h>

#include "spindle/base/json.hpp"

namespace spindle::report {
namespace {

/// Appends `items` between two brackets, separated by commas.
template <typename Items, typename Append>
void append_list(std::string& out, char open, char close, const Items& items, Append append_item) {
  out += open;
  bool first = true;
  for (const auto& item : items) {
    if (!first) out += ',';
    first = false;
    append_item(item);
  }
  out += close;
}

struct AppendCell {
  std::string& out;

  void operator()(std::monostate /*null*/) const { out += "null"; }
  void operator()(const Decimal& number) const { out += number.to_string(); }
  void operator()(const std::string& text) const { append_json_string(out, text); }
  void operator()(bool truth) const { out += truth ? "true" : "false"; }
  void operator()(const Words& words) const {
    append_list(out, '[', ']', words, [this](std::uint16_t word) {
      const fmt::format_int digits(word);
      out.append(digits.data(), digits.size());
    });
  }
  void operator()(const Numbers& numbers) const {
    append_list(out, '[', ']', numbers, [this](const std::optional<Decimal>& one) {
      out += one ? one->to_string() : "null";
    });
  }
  void operator()(const Texts& texts) const {
    append_list(out, '[', ']', texts,
                [this](const std::string& text) { append_json_string(out, text); });
  }
  void operator()(const Pairs& pairs) const {
    append_list(out, '{', '}', pairs, [this](const auto& pair) {
      append_json_string(out, pair.first);
      out += ':';
      append_json_string(out, pair.second);
    });
  }
};

}  // namespace

std::string to_json(const Record& record) {
  std::string text;
  append_json(text, record);
  return text;
}

void append_json(std::string& out, const Cell& cell) { std::visit(AppendCell{out}, cell); }

void append_json(std::string& out, const Record& record) {
  out += R"({"schema":"spindle/1","type":)";
  append_json_string(out, record.type);
  out += R"(,"time":)";
  append_json_string(out, to_text(record.time));
  out += R"(,"target":)";
  if (record.target.empty()) {
    out += "null";
  } else {
    append_json_string(out, record.target);
  }
  for (const Field& field : record.fields) {
    if (field.audience == Audience::columns) continue;
    out += ',';
    append_json_string(out, field.key);
    out += ':';
    std::visit(AppendCell{out}, field.cell);
  }
  out += '}';
}

}  // namespace spindle::report
