#include <algorithm>
#include <numeric>

#include "display.hpp"
#include "renderers.hpp"

namespace spindle::report {
namespace {

/// A cell of a table. What stands in it is part of one text for all cells.
struct Drawn {
  std::size_t begin = 0;
  std::size_t size = 0;
  std::size_t width = 0;  ///< cells of a terminal
  Tone tone = Tone::plain;

  [[nodiscard]] std::string_view in(std::string_view texts) const {
    return texts.substr(begin, size);
  }
};
using Row = std::span<const Drawn>;

Drawn append_drawn(std::string& texts, std::string_view text, Tone tone) {
  Drawn drawn{.begin = texts.size(), .tone = tone};
  drawn.width = append_cells(texts, text);
  drawn.size = texts.size() - drawn.begin;
  return drawn;
}

constexpr std::string_view gap = "  ";
constexpr std::string_view bold = "\x1b[1m";
constexpr std::string_view green = "\x1b[32m";
constexpr std::string_view red = "\x1b[31m";
constexpr std::string_view plain = "\x1b[0m";

void append_colored(std::string& line, std::string_view text, Tone tone, Color color) {
  const bool is_colored = color != Color::off && tone != Tone::plain;
  if (is_colored) line += tone == Tone::good ? green : red;
  line += text;
  if (is_colored) line += plain;
}

/// Appends a line without spaces at its end.
void draw(Row row, std::string_view texts, std::span<const Column> columns,
          std::span<const std::size_t> widths, Color color, std::string& out) {
  std::size_t used = row.size();
  while (used > 0 && row[used - 1].size == 0) --used;
  for (std::size_t index = 0; index < used; ++index) {
    if (index != 0) out += gap;
    const std::size_t width = row[index].width;
    const std::size_t padding = widths[index] > width ? widths[index] - width : 0;
    const bool is_right = columns[index].align == Align::right;
    if (is_right) out.append(padding, ' ');
    append_colored(out, row[index].in(texts), row[index].tone, color);
    if (!is_right && index + 1 < used) out.append(padding, ' ');
  }
  out.erase(out.find_last_not_of(' ') + 1);
  out += '\n';
}

class TableRenderer final : public PlainRenderer {
 public:
  using PlainRenderer::PlainRenderer;

  Result<void> begin(std::span<const Column> columns) override {
    TRY(end());
    columns_.assign(columns.begin(), columns.end());
    widths_.clear();
    places_.assign(columns_.size(), 0);
    for (const Column& column : columns_) {
      widths_.push_back(std::max(column.width, display_width(column.title)));
    }
    if (heading_ == Heading::drawn) heading_ = Heading::another;
    return {};
  }

  Result<void> record(const Record& record) override {
    std::string made;
    for (std::size_t index = 0; index < columns_.size(); ++index) {
      const Field* const field = find_field(record, index);
      cells_.push_back(append_drawn(texts_, shown_text(record, columns_[index].key, field, made),
                                    field == nullptr ? Tone::plain : field->tone));
    }
    return is_live() ? flush() : Result<void>{};
  }

  Result<void> end() override {
    if (is_live()) return {};
    for (std::size_t at = 0; at < cells_.size(); ++at) {
      std::size_t& width = widths_[at % widths_.size()];
      width = std::max(width, cells_[at].width);
    }
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

  /// The field of a column. Records of one table have most fields at the same places.
  const Field* find_field(const Record& record, std::size_t column) {
    const std::string& key = columns_[column].key;
    std::size_t& place = places_[column];
    if (place < record.fields.size() && record.fields[place].key == key) {
      return &record.fields[place];
    }
    const Field* const field = record.find(key);
    if (field != nullptr) place = static_cast<std::size_t>(field - record.fields.data());
    return field;
  }

  void add_header(std::string& text) {
    std::string texts;
    std::vector<Drawn> titles;
    for (const Column& column : columns_) {
      titles.push_back(append_drawn(texts, column.title, Tone::plain));
    }
    const bool is_bold = streams().color != Color::off;
    if (is_bold) text += bold;
    draw(titles, texts, columns_, widths_, Color::off, text);
    if (is_bold) text.insert(text.size() - 1, plain);
  }

  Result<void> flush() {
    if (cells_.empty()) return {};
    const std::size_t rows = cells_.size() / columns_.size();
    std::string text;
    text.reserve((rows + 1) * std::accumulate(widths_.begin(), widths_.end(), std::size_t{}));
    if (heading_ == Heading::another) text += '\n';
    if (heading_ != Heading::drawn) add_header(text);
    for (std::size_t row = 0; row < rows; ++row) {
      draw(Row(cells_).subspan(row * columns_.size(), columns_.size()), texts_, columns_, widths_,
           streams().color, text);
    }
    cells_.clear();
    texts_.clear();
    heading_ = Heading::drawn;
    return streams().out(text);
  }

  std::vector<Column> columns_;
  std::vector<std::size_t> widths_;
  std::vector<std::size_t> places_;  ///< where the field of a column stood in the last record
  std::vector<Drawn> cells_;         ///< row by row
  std::string texts_;                ///< of the cells
  Heading heading_ = Heading::first;
};

}  // namespace

std::unique_ptr<Renderer> make_table_renderer(Streams& streams, Verbosity verbosity) {
  return std::make_unique<TableRenderer>(streams, verbosity);
}

}  // namespace spindle::report
