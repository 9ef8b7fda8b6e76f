#include "json_writer.hpp"

#include <fmt/format.h>

#include <iterator>

#include "characters.hpp"
#include "utf8.hpp"

namespace spindle::report {
namespace {

/// Escaped in UTF-16, as RFC 8259, section 7 wants it.
void append_escaped(std::string& out, char32_t value) {
  constexpr char32_t first_of_two_units = 0x10000;
  if (value < first_of_two_units) {
    fmt::format_to(std::back_inserter(out), "\\u{:04x}", static_cast<std::uint32_t>(value));
    return;
  }
  const auto beyond = static_cast<std::uint32_t>(value - first_of_two_units);
  fmt::format_to(std::back_inserter(out), "\\u{:04x}\\u{:04x}", 0xD800U | (beyond >> 10U),
                 0xDC00U | (beyond & 0x3FFU));
}

std::string_view short_escape(char32_t value) {
  switch (value) {
    case U'"':
      return "\\\"";
    case U'\\':
      return "\\\\";
    case U'\b':
      return "\\b";
    case U'\f':
      return "\\f";
    case U'\n':
      return "\\n";
    case U'\r':
      return "\\r";
    case U'\t':
      return "\\t";
    default:
      return {};
  }
}

/// Appends the first character of `text` and returns how many bytes it took.
std::size_t append_character(std::string& out, std::string_view text) {
  const CodePoint character = first_code_point(text);
  if (const std::string_view escape = short_escape(character.value); !escape.empty()) {
    out += escape;
  } else if (steers(character.value)) {
    append_escaped(out, character.value);
  } else {
    append_first(out, character, text);
  }
  return character.length;
}

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

void append_json_string(std::string& out, std::string_view text) {
  out += '"';
  while (!text.empty()) {
    const std::size_t plain = plain_prefix(text);
    out += text.substr(0, plain);
    text.remove_prefix(plain);
    if (!text.empty()) text.remove_prefix(append_character(out, text));
  }
  out += '"';
}

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
