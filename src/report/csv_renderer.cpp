#include <algorithm>

#include "display.hpp"
#include "renderers.hpp"

namespace spindle::report {
namespace {

constexpr std::string_view line_end = "\r\n";

/// RFC 4180, section 2: rules 5 to 7.
void append_csv_field(std::string& out, std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) {
    out += text;
    return;
  }
  out += '"';
  for (const char character : text) {
    if (character == '"') out += '"';
    out += character;
  }
  out += '"';
}

class CsvRenderer final : public PlainRenderer {
 public:
  CsvRenderer(Streams& streams, const Look& look)
      : PlainRenderer(streams, look.verbosity), look_(look) {}

  Result<void> begin(std::span<const Column> columns) override {
    TRY_LET(const auto chosen, chosen_columns(columns, look_));
    std::vector<std::string> keys;
    keys.reserve(chosen.size() + 1);
    for (const Column& column : chosen) keys.push_back(column.key);
    if (look_.columns.empty()) name_target(keys);
    if (keys == keys_) return {};
    keys_ = std::move(keys);
    return write_line([](std::string_view key) { return std::string(key); });
  }

  Result<void> record(const Record& record) override {
    std::string made;
    return write_line([&](std::string_view key) {
      return printable(cell_text(record, key, made), LineBreaks::keep);
    });
  }

  Result<void> end() override { return {}; }

 private:
  /// One tool has the same columns as several.
  static void name_target(std::vector<std::string>& keys) {
    if (std::find(keys.begin(), keys.end(), "target") != keys.end()) return;
    const bool has_time = !keys.empty() && keys.front() == "time";
    keys.insert(keys.begin() + (has_time ? 1 : 0), "target");
  }

  template <typename TextOfKey>
  Result<void> write_line(TextOfKey text_of) {
    line_.clear();
    for (const std::string& key : keys_) {
      if (&key != &keys_.front()) line_ += ',';
      append_csv_field(line_, text_of(key));
    }
    line_ += line_end;
    return lines_.write(line_);
  }

  Look look_;
  std::vector<std::string> keys_;
  std::string line_;
  LineWriter lines_{streams(), line_end};
};

}  // namespace

std::unique_ptr<Renderer> make_csv_renderer(Streams& streams, const Look& look) {
  return std::make_unique<CsvRenderer>(streams, look);
}

}  // namespace spindle::report
