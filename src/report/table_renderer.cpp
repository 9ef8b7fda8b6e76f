#include <algorithm>
#include <numeric>

#include "display.hpp"
#include "layout.hpp"
#include "renderers.hpp"
#include "spindle/base/local_time.hpp"

namespace spindle::report {
namespace {

constexpr std::string_view bold = "\x1b[1m";
constexpr std::string_view plain = "\x1b[0m";

class TableRenderer final : public PlainRenderer {
 public:
  TableRenderer(Streams& streams, const Look& look)
      : PlainRenderer(streams, look.verbosity), look_(look) {}

  Result<void> begin(std::span<const Column> columns) override {
    TRY(end());
    TRY_LET(auto chosen, chosen_columns(columns, look_));
    columns_ = std::move(chosen);
    natural_ = {};
    natural_.are_empty.assign(columns_.size(), !is_live());
    places_.assign(columns_.size(), 0);
    for (const Column& column : columns_) {
      const std::size_t width =
          is_local(column) && column.width > 0 ? local_time_width : column.width;
      natural_.widths.push_back(std::max(width, display_width(column.title)));
    }
    if (heading_ == Heading::drawn) heading_ = Heading::another;
    return {};
  }

  Result<void> record(const Record& record) override {
    std::string made;
    for (std::size_t index = 0; index < columns_.size(); ++index) {
      const Field* const field = find_field(record, index);
      if (is_local(columns_[index])) {
        add_local_time(record, columns_[index], field);
        continue;
      }
      cells_.push_back(append_drawn(texts_, shown_text(record, columns_[index].key, field, made),
                                    field == nullptr ? Tone::plain : field->tone));
    }
    return is_live() ? flush() : Result<void>{};
  }

  Result<void> end() override {
    if (is_live()) return {};
    for (std::size_t at = 0; at < cells_.size(); ++at) {
      const std::size_t column = at % columns_.size();
      natural_.widths[column] = std::max(natural_.widths[column], cells_[at].width);
      if (cells_[at].width > 0) natural_.are_empty[column] = false;
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

  /// Whether the times of a column are those of the user's zone.
  [[nodiscard]] bool is_local(const Column& column) {
    return look_.clock != nullptr && streams().out_is_terminal && is_time(column);
  }

  /// Text that is no time stands as it is.
  void add_local_time(const Record& record, const Column& column, const Field* field) {
    std::string made;
    const std::string_view text = shown_text(record, column.key, field, made);
    const bool is_own = field == nullptr && column.key == "time";
    const auto time =
        is_own || text.empty() ? Result<WallTime>(record.time) : parse_time(text, *look_.clock);
    const bool is_told = time && (is_own || !text.empty());
    const std::string local = is_told ? to_local_text(*time, *look_.clock) : std::string(text);
    cells_.push_back(append_drawn(texts_, local, Tone::plain));
  }

  /// Cells of a row that the table has to fit in; 0: as many as it takes.
  [[nodiscard]] std::size_t room() {
    const bool fits = streams().out_is_terminal && look_.format != Format::wide;
    return fits && streams().out_columns ? streams().out_columns() : 0;
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

  void add_header(const Table& table, std::string& text) {
    std::string texts;
    std::vector<Drawn> titles;
    for (const Column& column : columns_) {
      titles.push_back(append_drawn(texts, column.title, Tone::plain));
    }
    const bool is_bold = table.color != Color::off;
    if (is_bold) text += bold;
    draw_row(titles, texts, table, RowKind::head, text);
    if (is_bold) text.insert(text.size() - 1, plain);
  }

  Result<void> flush() {
    if (cells_.empty()) return {};
    // A terminal may have another width by now.
    if (const std::size_t now = room(); heading_ != Heading::drawn || now != layout_.room) {
      if (heading_ == Heading::drawn) heading_ = Heading::another;
      layout_ = lay_out(columns_, natural_, now);
    }
    const Table table{columns_, layout_, streams().color, look_.clock != nullptr};
    const std::size_t rows = cells_.size() / columns_.size();
    const auto& widths = layout_.widths;
    std::string text;
    text.reserve((rows + 1) * std::accumulate(widths.begin(), widths.end(), std::size_t{}));
    if (heading_ == Heading::another) text += '\n';
    if (heading_ != Heading::drawn) add_header(table, text);
    for (std::size_t row = 0; row < rows; ++row) {
      draw_row(Row(cells_).subspan(row * columns_.size(), columns_.size()), texts_, table,
               RowKind::record, text);
    }
    cells_.clear();
    texts_.clear();
    heading_ = Heading::drawn;
    return streams().out(text);
  }

  Look look_;
  std::vector<Column> columns_;
  Natural natural_;
  std::vector<std::size_t> places_;  ///< where the field of a column stood in the last record
  std::vector<Drawn> cells_;         ///< row by row
  std::string texts_;                ///< of the cells
  Layout layout_;                    ///< as it was drawn last
  Heading heading_ = Heading::first;
};

}  // namespace

std::unique_ptr<Renderer> make_table_renderer(Streams& streams, const Look& look) {
  return std::make_unique<TableRenderer>(streams, look);
}

}  // namespace spindle::report
