#include <algorithm>

#include "display.hpp"
#include "renderers.hpp"

namespace spindle::report {
namespace {

struct Drawn {
  std::string text;
  Tone tone = Tone::plain;
};
using Row = std::vector<Drawn>;

constexpr std::string_view gap = "  ";
constexpr std::string_view bold = "\x1b[1m";
constexpr std::string_view green = "\x1b[32m";
constexpr std::string_view red = "\x1b[31m";
constexpr std::string_view plain = "\x1b[0m";

std::string colored(const Drawn& cell, Color color) {
  if (color == Color::off || cell.tone == Tone::plain) return cell.text;
  return std::string(cell.tone == Tone::good ? green : red).append(cell.text).append(plain);
}

std::string draw(const Row& row, std::span<const Column> columns,
                 std::span<const std::size_t> widths, Color color) {
  std::string line;
  for (std::size_t index = 0; index < row.size(); ++index) {
    if (index != 0) line += gap;
    const std::size_t width = display_width(row[index].text);
    const std::string padding(widths[index] > width ? widths[index] - width : 0, ' ');
    const std::string text = colored(row[index], color);
    line += columns[index].align == Align::right ? padding + text : text + padding;
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
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
      row.push_back({printable(shown_text(record, column.key), LineBreaks::fold),
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
      widths_[index] = std::max(widths_[index], display_width(row[index].text));
    }
  }

  [[nodiscard]] std::string header() {
    Row titles;
    for (const Column& column : columns_) titles.push_back({column.title});
    std::string line = draw(titles, columns_, widths_, Color::off);
    if (streams().color == Color::off) return line;
    return std::string(bold).append(line).append(plain);
  }

  Result<void> flush() {
    if (rows_.empty() || columns_.empty()) return {};
    std::string text;
    if (heading_ == Heading::another) text += '\n';
    if (heading_ != Heading::drawn) text += header() + '\n';
    for (const Row& row : rows_) text += draw(row, columns_, widths_, streams().color) + '\n';
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

std::unique_ptr<Renderer> make_table_renderer(Streams& streams, Talk talk) {
  return std::make_unique<TableRenderer>(streams, talk);
}

}  // namespace spindle::report
