#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "renderers.hpp"
#include "spindle/base/text.hpp"

namespace spindle::report {
namespace {

std::vector<std::string> keys_of(std::span<const Column> columns) {
  std::vector<std::string> keys;
  keys.reserve(columns.size());
  for (const Column& column : columns) {
    const bool is_there = std::find(keys.begin(), keys.end(), column.key) != keys.end();
    if (!is_there) keys.push_back(column.key);
  }
  return keys;
}

Result<Column> find_column(std::string_view word, std::span<const Column> columns) {
  const auto found = std::find_if(columns.begin(), columns.end(), [&](const Column& column) {
    return same_ignoring_case(column.key, word) || same_ignoring_case(column.title, word);
  });
  if (found != columns.end()) {
    Column column = *found;
    column.room.rank = 0;  // it was asked for
    return column;
  }
  const std::vector<std::string> keys = keys_of(columns);
  std::string hint = suggestion(word, keys);
  if (!hint.empty()) hint += ' ';
  return tl::unexpected(Error{.code = Errc::usage,
                              .message = fmt::format("--columns: '{}' is no column here", word),
                              .hint = hint + fmt::format("it has {}", fmt::join(keys, ", "))});
}

/// What -o value shows unless it is said.
Result<std::vector<Column>> value_column(std::span<const Column> columns) {
  const auto found = std::find_if(columns.begin(), columns.end(),
                                  [](const auto& one) { return one.key == "value"; });
  if (found != columns.end()) return std::vector<Column>{*found};
  return tl::unexpected(Error{
      .code = Errc::usage,
      .message = "-o value: there is no column 'value' here",
      .hint = fmt::format("say which with --columns: {}", fmt::join(keys_of(columns), ", "))});
}

}  // namespace

Result<std::vector<Column>> chosen_columns(std::span<const Column> columns, const Look& look) {
  std::vector<Column> chosen;
  for (const std::string& word : look.columns) {
    TRY_LET(auto column, find_column(word, columns));
    chosen.push_back(std::move(column));
  }
  if (!chosen.empty()) return chosen;
  if (look.format == Format::value) return value_column(columns);
  const bool all = look.format == Format::wide || look.format == Format::csv;
  std::copy_if(columns.begin(), columns.end(), std::back_inserter(chosen),
               [&](const Column& one) { return all || one.room.shown == Shown::always; });
  return chosen;
}

}  // namespace spindle::report
