#include <algorithm>
#include <numeric>

#include "display.hpp"
#include "renderers.hpp"

namespace spindle::report {
namespace {

struct Drawn {
  Cells cells;
  Tone tone = Tone::plain;
};
using Row = std::vector<Drawn>;

constexpr std::string_view gap = "  ";
constexpr std::string_view bold = "\x1b[1m";
constexpr std::string_view green = "\x1b[32m";
constexpr std::string_view red = "\x1b[31m";
constexpr std::string_view plain = "\x1b[0m";

void append_colored(std::string& line, const Drawn& cell, Color color) {
  const bool is_colored = color != Color::off && cell.tone != Tone::plain;
  if (is_colored) line += cell.tone == Tone::good ? green : red;
  line += cell.cells.text;
  if (is_colored) line += plain;
}

/// Appends a line without spaces at its end.
void draw(const Row& row, std::span<const Column> columns, std::span<const std::size_t> widths,
          Color color, std::string& out) {
  std::size_t used = row.size();
  while (used > 0 && row[used - 1].cells.text.empty()) --used;
  for (std::size_t index = 0; index < used; ++index) {
    if (index != 0) out += gap;
    const std::size_t width = row[index].cells.width;
    const std::size_t padding = widths[index] > width ? widths[index] - width : 0;
    const bool is_right = columns[index].align == Align::right;
    if (is_right) out.append(padding, ' ');
    append_colored(out, row[index], color);
    if (!is_right && index + 1 < used) out.append(padding, ' ');
  }
  out.erase(out.find_last_not_of(' ') + 1);
  out += '\n';
}

class TableRenderer final : public PlainRenderer {
 public:
  using PlainRenderer::PlainRenderer;

  Result<void> begin(std::span<const Column> columns) override {
    if (Result<void> flushed = end(); !flushed) return flushed;
    columns_.assign(columns.begin(), columns.end());
    widths_.clear();
    for (const Column& column : columns_) {
      widths_.push_back(std::max(column.width, display_width(column.title)));
    }
    if (heading_ == Heading::drawn) heading_ = Heading::another;
    return {};
  }

  Result<void> record(const Record& record) override {
    Row row;
    row.reserve(columns_.size());
    for (const Column& column : columns_) {
      const Field* const field = record.find(column.key);
      row.push_back({to_cells(shown_text(record, column.key, field)),
                     field == nullptr ? Tone::plain : field->tone});
    }
    rows_.push_back(std::move(row));
    return is_live() ? flush() : Result<void>{};
  }

  Result<void> end() override {
    if (is_live()) return {};
    for (const Row& row : rows_) widen(row);
    return flush();
  }

 private:
  /// Which header line comes next: the first one, another one behind a blank line, or none.
  enum class Heading : std::uint8_t { first, another, drawn };

  /// Whether rows are drawn as they come, because all widths were given.
  [[nodiscard]] bool is_live() const {
    return !columns_.empty() && std::all_of(columns_.begin(), columns_.end(),
                                            [](const Column& column) { return column.width > 0; });
  }

  void widen(const Row& row) {
    for (std::size_t index = 0; index < row.size(); ++index) {
      widths_[index] = std::max(widths_[index], row[index].cells.width);
    }
  }

  void add_header(std::string& text) {
    Row titles;
    for (const Column& column : columns_) titles.push_back({to_cells(column.title)});
    const bool is_bold = streams().color != Color::off;
    if (is_bold) text += bold;
    draw(titles, columns_, widths_, Color::off, text);
    if (is_bold) text.insert(text.size() - 1, plain);
  }

  Result<void> flush() {
    if (rows_.empty() || columns_.empty()) return {};
    std::string text;
    text.reserve((rows_.size() + 1) *
                 std::accumulate(widths_.begin(), widths_.end(), std::size_t{}));
    if (heading_ == Heading::another) text += '\n';
    if (heading_ != Heading::drawn) add_header(text);
    for (const Row& row : rows_) draw(row, columns_, widths_, streams().color, text);
    rows_.clear();
    heading_ = Heading::drawn;
    return streams().out(text);
  }

  std::vector<Column> columns_;
  std::vector<std::size_t> widths_;
  std::vector<Row> rows_;
  Heading heading_ = Heading::first;
};

}  // namespace

std::unique_ptr<Renderer> make_table_renderer(Streams& streams, Verbosity verbosity) {
  return std::make_unique<TableRenderer>(streams, verbosity);
}

}  // namespace spindle::report
