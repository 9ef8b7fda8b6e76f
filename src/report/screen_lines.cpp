#include "spindle/report/screen_lines.hpp"

#include <algorithm>

#include "display.hpp"
#include "layout.hpp"

namespace spindle::report {

std::vector<ScreenLine> screen_lines(std::span<const Column> columns,
                                     std::span<const Record> records, std::size_t room,
                                     Color color) {
  std::string texts;
  std::vector<Drawn> cells;
  Natural natural{.widths = std::vector<std::size_t>(columns.size(), 0),
                  .are_empty = std::vector<bool>(columns.size(), true)};
  std::string made;
  for (const Record& record : records) {
    for (std::size_t at = 0; at < columns.size(); ++at) {
      const Field* const field = record.find(columns[at].key);
      cells.push_back(append_drawn(texts, shown_text(record, columns[at].key, field, made),
                                   field == nullptr ? Tone::plain : field->tone));
      natural.widths[at] = std::max(natural.widths[at], cells.back().width);
      if (cells.back().width > 0) natural.are_empty[at] = false;
    }
  }
  Layout layout = lay_out(columns, natural, room);
  for (std::size_t at = 0; at < columns.size(); ++at) {
    if (natural.are_empty[at]) layout.is_shown[at] = false;
  }
  std::vector<ScreenLine> lines(records.size());
  for (std::size_t row = 0; row < lines.size(); ++row) {
    lines[row].width = draw_line(Row(cells).subspan(row * columns.size(), columns.size()), texts,
                                 {columns, layout, color}, lines[row].text);
  }
  return lines;
}

ScreenLine screen_line(std::string_view text, std::size_t room) {
  ScreenLine line{.text = fitted(printable(text, LineBreaks::fold), room, Keep::beginning)};
  line.width = display_width(line.text);
  return line;
}

}  // namespace spindle::report
