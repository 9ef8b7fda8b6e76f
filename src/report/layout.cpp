#include "layout.hpp"

#include <algorithm>
#include <array>
#include <numeric>

#include "display.hpp"
#include "spindle/base/characters.hpp"
#include "spindle/base/utf8.hpp"

namespace spindle::report {
namespace {

constexpr std::string_view gap = "  ";
constexpr std::string_view green = "\x1b[32m";
constexpr std::string_view red = "\x1b[31m";
constexpr std::string_view plain = "\x1b[0m";
/// In front of what stands below a row.
constexpr std::size_t indent = 4;
/// What the column that may stand below is left, before times are told longer than they need be.
constexpr std::size_t room_of_last = 24;
/// Of a column that wraps although its table does not say so.
constexpr std::size_t least_of_all = 8;

/// A part of the text of a local time that says less, by its width.
struct TimeForm {
  std::size_t begin;
  std::size_t width;
};
/// "2026-11-30 14:00:05.123+01:00", "2026-11-30 14:00:05", "11-30 14:00:05".
constexpr std::array<TimeForm, 3> time_forms = {{{0, local_time_width}, {0, 19}, {5, 14}}};

std::size_t width_of(const Layout& layout, std::span<const Column> columns) {
  std::size_t width = 0;
  std::size_t shown = 0;
  for (std::size_t at = 0; at < columns.size(); ++at) {
    if (!layout.is_shown[at] || columns[at].room.narrow == Narrow::below) continue;
    width += layout.widths[at];
    ++shown;
  }
  return width + (shown > 1 ? (shown - 1) * gap.size() : 0);
}

std::size_t excess_of(const Layout& layout, std::span<const Column> columns) {
  const std::size_t width = width_of(layout, columns);
  return width > layout.room ? width - layout.room : 0;
}

/// A time has as much as one of its forms takes.
std::size_t whole_form(std::size_t width) {
  for (const TimeForm& form : time_forms) {
    if (form.width <= width) return form.width;
  }
  return width;
}

/// Gives columns that wrap what they need, from the first one on, as far as there is room.
void share_out(Layout& layout, std::span<const Column> columns,
               const std::vector<std::size_t>& natural) {
  const bool has_below = columns.back().room.narrow == Narrow::below;
  const std::size_t reserved = has_below ? gap.size() + room_of_last : 0;
  for (std::size_t at = 0; at < columns.size(); ++at) {
    if (!layout.is_shown[at] || columns[at].room.narrow != Narrow::wrap) continue;
    const std::size_t width = width_of(layout, columns) + reserved;
    const std::size_t free = layout.room > width ? layout.room - width : 0;
    layout.widths[at] = std::min(natural[at], layout.widths[at] + free);
    const bool is_local = is_time(columns[at]) && natural[at] == local_time_width;
    if (is_local) layout.widths[at] = whole_form(layout.widths[at]);
  }
}

/// The column that is left out next; empty where each that is left has to stay.
std::optional<std::size_t> lowest_rank(const Layout& layout, std::span<const Column> columns,
                                       const std::vector<bool>& are_empty) {
  std::optional<std::size_t> lowest;
  unsigned lowest_rank = 0;
  for (std::size_t at = 0; at < columns.size(); ++at) {
    const unsigned own = columns[at].room.rank;
    const unsigned rank = are_empty[at] ? 1 : own == 0 ? 0 : own + 1;
    if (!layout.is_shown[at] || rank == 0 || (lowest && rank >= lowest_rank)) continue;
    lowest = at;
    lowest_rank = rank;
  }
  return lowest;
}

/// Where nothing else is left: the widest texts wrap. Numbers never do: half of one is another one.
void wrap_widest(Layout& layout, std::span<const Column> columns) {
  for (std::size_t excess = excess_of(layout, columns); excess > 0;) {
    std::optional<std::size_t> widest;
    for (std::size_t at = 0; at < columns.size(); ++at) {
      const bool may_wrap = layout.is_shown[at] && columns[at].align == Align::left &&
                            columns[at].room.narrow != Narrow::below && !is_time(columns[at]);
      if (!may_wrap || layout.widths[at] <= least_of_all) continue;
      if (!widest || layout.widths[at] > layout.widths[*widest]) widest = at;
    }
    if (!widest) return;
    layout.widths[*widest] -= std::min(excess, layout.widths[*widest] - least_of_all);
    excess = excess_of(layout, columns);
  }
}

/// How many bytes of harmless text stand in so many cells, broken where people would break it.
std::size_t line_length(std::string_view text, std::size_t cells) {
  std::size_t width = 0;
  std::size_t length = 0;
  std::size_t break_at = 0;
  while (length < text.size()) {
    const CodePoint character = first_code_point(text.substr(length));
    width += cell_width(character.value);
    if (width > cells && text[length] == ' ') return length;
    if (width > cells) break;
    length += character.length;
    if (text[length - 1] == ' ' || text[length - 1] == '-' || text[length - 1] == '/' ||
        text[length - 1] == ',' || text[length - 1] == '.') {
      break_at = length;
    }
  }
  if (length == text.size()) return length;
  if (break_at > 0) return break_at;
  return std::max(length, first_code_point(text).length);
}

std::string_view without_spaces_at_end(std::string_view text) {
  return text.substr(0, text.find_last_not_of(' ') + 1);
}

/// The first line of a text, which is taken off.
std::string_view take_line(std::string_view& text, std::size_t cells) {
  const std::size_t length = line_length(text, cells);
  const std::string_view line = text.substr(0, length);
  text.remove_prefix(length);
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  return without_spaces_at_end(line);
}

void append_indented(std::string& out, std::string_view text, std::size_t room, Tone tone,
                     Color color) {
  const std::size_t cells = room > 2 * indent ? room - indent : room;
  while (!text.empty()) {
    out.append(room > cells ? indent : 0, ' ');
    append_colored(out, take_line(text, cells), tone, color);
    out += '\n';
  }
}

/// A cell while its row is drawn: what of it is still to come.
struct Rest {
  std::string_view text = {};
  std::size_t width = 0;  ///< of all of it
  Tone tone = Tone::plain;
};

/// One row on its way to its lines.
class RowDrawing {
 public:
  RowDrawing(Row row, std::string_view texts, const Table& table, RowKind kind, std::string& out)
      : table_(&table), kind_(kind), out_(&out) {
    for (std::size_t at = 0; at < row.size(); ++at) {
      rests_.push_back({row[at].in(texts), row[at].width, row[at].tone});
      if (kind == RowKind::record) cut_time(at);
    }
    tell_left_out();
    take_below();
  }

  void draw() {
    bool is_first = true;
    do {
      draw_next(is_first);
      is_first = false;
    } while (has_rest());
    append_indented(*out_, below_.text, room(), below_.tone, color());
  }

 private:
  [[nodiscard]] std::size_t room() const { return table_->layout.room; }
  [[nodiscard]] Color color() const { return kind_ == RowKind::head ? Color::off : table_->color; }
  [[nodiscard]] std::size_t width(std::size_t at) const { return table_->layout.widths[at]; }
  [[nodiscard]] bool is_shown(std::size_t at) const { return table_->layout.is_shown[at]; }
  [[nodiscard]] bool is_last(std::size_t at) const { return at + 1 == rests_.size(); }
  /// Whether the text of a column goes on in further lines.
  [[nodiscard]] bool wraps(std::size_t at) const {
    return room() > 0 && table_->columns[at].align == Align::left &&
           table_->columns[at].room.narrow != Narrow::below;
  }

  void cut_time(std::size_t at) {
    if (!table_->has_local_times || !is_time(table_->columns[at])) return;
    if (rests_[at].width != local_time_width) return;
    for (const TimeForm& form : time_forms) {
      if (form.width > width(at)) continue;
      rests_[at].text = rests_[at].text.substr(form.begin, form.width);
      rests_[at].width = form.width;
      return;
    }
  }

  /// What is not as usual is told also where its column was left out.
  void tell_left_out() {
    if (kind_ == RowKind::head || room() == 0) return;
    for (std::size_t at = 0; at + 1 < rests_.size(); ++at) {
      const std::string_view usual = table_->columns[at].room.usual;
      const std::string_view text = rests_[at].text;
      if (is_shown(at) || usual.empty() || text.empty() || text == usual) continue;
      Rest& last = rests_.back();
      marked_ = "[" + std::string(text) + "]";
      if (!last.text.empty()) marked_.append(" ").append(last.text);
      last.text = marked_;
      last.width = display_width(marked_);
      return;
    }
  }

  /// The last column stands below the row, or is left out of the head, where it finds no room.
  void take_below() {
    if (room() == 0 || rests_.empty()) return;
    const std::size_t last = rests_.size() - 1;
    if (table_->columns[last].room.narrow != Narrow::below || !is_shown(last)) return;
    const std::size_t before = width_of(table_->layout, table_->columns) + gap.size();
    if (before + rests_[last].width <= room()) return;
    if (kind_ == RowKind::record) below_ = rests_[last];
    rests_[last] = {};
  }

  [[nodiscard]] bool has_rest() const {
    for (std::size_t at = 0; at < rests_.size(); ++at) {
      if (is_shown(at) && !rests_[at].text.empty()) return true;
    }
    return false;
  }

  std::string_view take(std::size_t at, std::size_t& taken) {
    Rest& rest = rests_[at];
    if (!wraps(at) || rest.width <= width(at)) {
      taken = std::exchange(rest.width, 0);
      return std::exchange(rest.text, {});
    }
    const std::string_view line = take_line(rest.text, width(at));
    rest.width = display_width(rest.text);
    taken = display_width(line);
    return line;
  }

  void draw_next(bool is_first) {
    const std::size_t begin = out_->size();
    bool has_column = false;
    for (std::size_t at = 0; at < rests_.size(); ++at) {
      if (!is_shown(at)) continue;
      if (has_column) *out_ += gap;
      has_column = true;
      std::size_t taken = 0;
      const Tone tone = rests_[at].tone;
      const std::string_view text = take(at, taken);
      const std::size_t padding = width(at) > taken ? width(at) - taken : 0;
      const bool is_right = table_->columns[at].align == Align::right;
      if (is_right) out_->append(padding, ' ');
      append_colored(*out_, text, text.empty() ? Tone::plain : tone, color());
      if (!is_right && !is_last(at)) out_->append(padding, ' ');
    }
    const std::size_t end = out_->find_last_not_of(' ');
    out_->erase(end == std::string::npos ? begin : std::max(begin, end + 1));
    if (is_first || out_->size() > begin) *out_ += '\n';
  }

  const Table* table_;
  RowKind kind_;
  std::string* out_;
  std::vector<Rest> rests_ = {};
  Rest below_ = {};
  std::string marked_ = {};
};

}  // namespace

bool is_time(const Column& column) { return column.key == "time"; }

Drawn append_drawn(std::string& texts, std::string_view text, Tone tone) {
  Drawn drawn{.begin = texts.size(), .tone = tone};
  drawn.width = append_cells(texts, text);
  drawn.size = texts.size() - drawn.begin;
  return drawn;
}

void append_colored(std::string& line, std::string_view text, Tone tone, Color color) {
  const bool is_colored = color != Color::off && tone != Tone::plain;
  if (is_colored) line += tone == Tone::good ? green : red;
  line += text;
  if (is_colored) line += plain;
}

Layout lay_out(std::span<const Column> columns, const Natural& natural, std::size_t room) {
  Layout layout{
      .is_shown = std::vector<bool>(columns.size(), true), .widths = natural.widths, .room = room};
  if (room == 0 || excess_of(layout, columns) == 0) return layout;
  for (std::size_t at = 0; at < columns.size(); ++at) {
    if (columns[at].room.narrow != Narrow::wrap) continue;
    layout.widths[at] = std::min<std::size_t>(natural.widths[at], columns[at].room.least);
  }
  while (excess_of(layout, columns) > 0) {
    const auto lowest = lowest_rank(layout, columns, natural.are_empty);
    if (!lowest) break;
    layout.is_shown[*lowest] = false;
  }
  wrap_widest(layout, columns);
  share_out(layout, columns, natural.widths);
  return layout;
}

void draw_row(Row row, std::string_view texts, const Table& table, RowKind kind, std::string& out) {
  RowDrawing(row, texts, table, kind, out).draw();
}

std::size_t draw_line(Row row, std::string_view texts, const Table& table, std::string& out) {
  std::size_t used = 0;
  std::size_t pending = 0;  // spaces, which are drawn only before something else
  for (std::size_t at = 0; at < row.size(); ++at) {
    if (!table.layout.is_shown[at]) continue;
    const std::size_t wanted = table.layout.widths[at];
    const std::size_t begin = used + pending;
    const std::size_t free = table.layout.room > begin ? table.layout.room - begin : 0;
    const bool is_last = at + 1 == row.size();
    const bool is_right = table.columns[at].align == Align::right;
    // A part of a number is another number.
    if (is_right && row[at].width > free) continue;
    const std::string text =
        fitted(row[at].in(texts), is_last ? free : std::min(wanted, free), Keep::beginning);
    const std::size_t width = display_width(text);
    const std::size_t padding = std::min(wanted > width ? wanted - width : 0, free - width);
    if (is_right) pending += padding;
    if (!text.empty()) {
      out.append(pending, ' ');
      append_colored(out, text, row[at].tone, table.color);
      used += pending + width;
      pending = 0;
    }
    pending += (is_right ? 0 : padding) + gap.size();
  }
  return used;
}

}  // namespace spindle::report
