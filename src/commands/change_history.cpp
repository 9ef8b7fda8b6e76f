#include "change_history.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/files/change_log.hpp"

namespace spindle::commands {
namespace {

report::Cell cell_of(const report::Record& record, std::string_view key) {
  const report::Field* field = record.find(key);
  return field == nullptr ? report::Cell() : field->cell;
}

std::string text_of(const report::Record& record, std::string_view key) {
  return report::to_text(cell_of(record, key));
}

std::optional<PastChange> change_of(std::string_view line) {
  const auto record = report::record_of(line);
  if (!record || record->type != "changed") return std::nullopt;
  return PastChange{.id = text_of(*record, "id"),
                    .time = text_of(*record, "time"),
                    .user = text_of(*record, "user"),
                    .command = text_of(*record, "command"),
                    .target = record->target,
                    .serial = text_of(*record, "serial"),
                    .name = text_of(*record, "name"),
                    .register_address = cell_of(*record, "register"),
                    .before = cell_of(*record, "old"),
                    .after = cell_of(*record, "new"),
                    .result = text_of(*record, "result"),
                    .unit = text_of(*record, "unit"),
                    .label_before = text_of(*record, "old_label"),
                    .label_after = text_of(*record, "new_label"),
                    .undoes = text_of(*record, "undoes")};
}

/// Two commands may have the same id, by chance.
bool is_end_of(const PastChange& change, const PastChange& begun) {
  return change.result != files::begun && change.command == begun.command &&
         change.target == begun.target && change.serial == begun.serial &&
         change.name == begun.name;
}

}  // namespace

Result<ChangeHistory> read_changes(const Context& context) {
  ChangeHistory history;
  const std::string path = context.state_folder + "/changes.jsonl";
  if (context.state_folder.empty() || context.disk.absent(path)) return history;
  TRY_LET(const auto text, context.disk.read(path));
  std::multimap<std::string, std::size_t> begun_at;
  for (const std::string_view line : split(text, '\n')) {
    if (line.empty()) continue;
    auto change = change_of(line);
    if (!change) {
      ++history.unreadable;
      continue;
    }
    const auto [first, last] = begun_at.equal_range(change->id);
    const auto known = std::find_if(first, last, [&](const auto& begun) {
      return is_end_of(*change, history.changes[begun.second]);
    });
    if (known == last) {
      const bool is_begun = !change->id.empty() && change->result == files::begun;
      if (is_begun) begun_at.emplace(change->id, history.changes.size());
      history.changes.push_back(std::move(*change));
      continue;
    }
    PastChange& entry = history.changes[known->second];
    begun_at.erase(known);
    change->time = entry.time;
    entry = std::move(*change);
  }
  return history;
}

}  // namespace spindle::commands
