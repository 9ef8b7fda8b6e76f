#include <algorithm>
#include <array>
#include <cctype>
#include <string_view>

#include "json_writer.hpp"
#include "renderers.hpp"
#include "spindle/base/json.hpp"
#include "spindle/base/text.hpp"

namespace spindle::report {
namespace {

/// What some reader of YAML 1.1 or 1.2 takes for a truth or for null.
constexpr std::array<std::string_view, 11> taken_words = {
    "y", "n", "yes", "no", "true", "false", "on", "off", "null", "nan", "inf"};

/// Whether every reader of YAML takes it for the same text without quotes: a word that begins with
/// a letter, of letters, digits and "_-./" alone.
bool is_plain_word(std::string_view text) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  if (text.empty() || !is_letter(text.front())) return false;
  const bool is_made_of_them = std::all_of(text.begin(), text.end(), [&](char c) {
    return is_letter(c) || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.' || c == '/';
  });
  return is_made_of_them && std::none_of(taken_words.begin(), taken_words.end(),
                                         [&](auto word) { return same_ignoring_case(word, text); });
}

void append_text(std::string& out, std::string_view text) {
  if (is_plain_word(text)) {
    out += text;
  } else {
    append_json_string(out, text);
  }
}

void append_key(std::string& out, std::string_view key) {
  append_text(out, key);
  out += ": ";
}

/// One document a record. What is no plain word stands as in JSON, which every YAML reader takes.
class YamlRenderer final : public PlainRenderer {
 public:
  using PlainRenderer::PlainRenderer;

  Result<void> begin(std::span<const Column> /*columns*/) override { return {}; }

  Result<void> record(const Record& record) override {
    text_.assign("---\n");
    append_key(text_, "schema");
    text_ += "spindle/1\n";
    append_key(text_, "type");
    append_text(text_, record.type);
    text_ += '\n';
    append_key(text_, "time");
    append_json_string(text_, to_text(record.time));
    text_ += '\n';
    append_key(text_, "target");
    if (record.target.empty()) {
      text_ += "null\n";
    } else {
      append_text(text_, record.target);
      text_ += '\n';
    }
    for (const Field& field : record.fields) {
      if (field.audience != Audience::everyone) continue;
      append_key(text_, field.key);
      if (const auto* words = std::get_if<std::string>(&field.cell)) {
        append_text(text_, *words);
      } else {
        append_json(text_, field.cell);
      }
      text_ += '\n';
    }
    return lines_.write(text_);
  }

  Result<void> end() override { return {}; }

  Result<void> line(const Record& record, std::string_view /*plain*/) override {
    return this->record(record);
  }

  Result<void> summary(const Record& counts, std::string_view /*sentence*/) override {
    return record(counts);
  }

  Result<void> error(const Error& error, WallTime time) override {
    Result<void> written = record(error_record(error, time));
    static_cast<void>(PlainRenderer::error(error, time));
    return written;
  }

 private:
  std::string text_;
  LineWriter lines_{streams(), "\n"};
};

}  // namespace

std::unique_ptr<Renderer> make_yaml_renderer(Streams& streams, Verbosity verbosity) {
  return std::make_unique<YamlRenderer>(streams, verbosity);
}

}  // namespace spindle::report
