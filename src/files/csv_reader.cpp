#include "files/csv_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "spindle/base/byte_order_mark.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::files {
namespace {

constexpr std::size_t most_fields = 100;

Error fault(const std::string& path, std::size_t line, std::string message, std::string hint = {}) {
  return {.code = Errc::bad_file,
          .message = fmt::format("{}:{}: {}", path, line, message),
          .hint = std::move(hint)};
}

/// Reads field by field.
class CsvReader {
 public:
  CsvReader(std::string_view text, const std::string& path, std::size_t most_rows)
      : text_(text), path_(&path), most_rows_(most_rows) {
    if (text_.starts_with(byte_order_mark)) text_.remove_prefix(byte_order_mark.size());
    separator_ = find_separator();
  }

  Result<std::vector<CsvRow>> run() {
    while (!text_.empty()) {
      CsvRow row{.line = line_};
      if (auto error = read_row(row)) return tl::unexpected(std::move(*error));
      const bool is_empty = std::all_of(row.fields.begin(), row.fields.end(),
                                        [](const std::string& field) { return field.empty(); });
      if (is_empty) continue;
      if (rows_.size() == most_rows_) {
        return tl::unexpected(
            fault(*path_, row.line, fmt::format("more than {} rows are too many", most_rows_)));
      }
      rows_.push_back(std::move(row));
    }
    return std::move(rows_);
  }

 private:
  [[nodiscard]] char find_separator() const {
    constexpr std::array<char, 3> separators = {',', ';', '\t'};
    std::array<std::ptrdiff_t, 3> found = {};
    bool in_quotes = false;
    for (const char c : text_) {
      if (c == '"') in_quotes = !in_quotes;
      if (in_quotes) continue;
      const bool is_known = std::any_of(found.begin(), found.end(), [](auto n) { return n > 0; });
      if (is_known && (c == '\n' || c == '\r')) break;
      const auto at = std::find(separators.begin(), separators.end(), c);
      if (at != separators.end()) ++found[static_cast<std::size_t>(at - separators.begin())];
    }
    return separators[static_cast<std::size_t>(std::max_element(found.begin(), found.end()) -
                                               found.begin())];
  }

  /// Takes one byte.
  char take() {
    const char c = text_.front();
    text_.remove_prefix(1);
    if (c == '\n' || (c == '\r' && !text_.starts_with('\n'))) ++line_;
    return c;
  }

  std::optional<Error> read_row(CsvRow& row) {
    while (true) {
      std::string field;
      if (auto error = read_field(field)) return error;
      row.fields.push_back(std::move(field));
      if (row.fields.size() > most_fields) {
        return fault(*path_, row.line, fmt::format("a row has {} fields at most", most_fields));
      }
      const bool goes_on = !text_.empty() && text_.front() == separator_;
      if (goes_on) {
        take();
        continue;
      }
      if (text_.starts_with("\r\n")) take();
      if (!text_.empty()) take();
      return std::nullopt;
    }
  }

  [[nodiscard]] bool at_end_of_field() const {
    return text_.empty() || text_.front() == separator_ || text_.front() == '\n' ||
           text_.front() == '\r';
  }

  void skip_blanks() {
    while (!text_.empty() && text_.front() == ' ') take();
  }

  std::optional<Error> read_field(std::string& field) {
    skip_blanks();
    if (text_.starts_with('"')) {
      if (auto error = read_quoted(field)) return error;
    }
    while (!at_end_of_field()) field += take();
    field.erase(field.find_last_not_of(" \n\r") + 1);
    return std::nullopt;
  }

  std::optional<Error> read_quoted(std::string& field) {
    const std::size_t begin = line_;
    take();
    while (!text_.empty()) {
      const char c = take();
      if (c != '"') {
        field += c;
      } else if (text_.starts_with('"')) {
        field += take();
      } else {
        return std::nullopt;
      }
    }
    return fault(*path_, begin, "a quote has no end");
  }

  std::string_view text_;
  const std::string* path_;
  std::size_t most_rows_;
  char separator_ = ',';
  std::size_t line_ = 1;
  std::vector<CsvRow> rows_ = {};
};

/// The first line with bytes that are no text.
std::optional<Error> find_garbage(std::string_view text, const std::string& path) {
  std::size_t line = 1;
  while (!text.empty()) {
    const CodePoint point = first_code_point(text);
    if (point.value == U'\0') return fault(path, line, "a NUL byte: this is no text");
    if (!point.well_formed) {
      return fault(path, line, "this is no UTF-8", "save it as 'CSV UTF-8'");
    }
    if (point.value == U'\n') ++line;
    text.remove_prefix(point.length);
  }
  return std::nullopt;
}

}  // namespace

Result<std::vector<CsvRow>> read_csv(std::string_view text, const std::string& path,
                                     std::size_t most_rows) {
  if (auto garbage = find_garbage(text, path)) return tl::unexpected(std::move(*garbage));
  return CsvReader(text, path, most_rows).run();
}

}  // namespace spindle::files
