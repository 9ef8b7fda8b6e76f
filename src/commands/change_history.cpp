#include "change_history.hpp"

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
                    .result = text_of(*record, "result")};
}

}  // namespace

Result<ChangeHistory> read_changes(const Context& context) {
  ChangeHistory history;
  const std::string path = context.state_folder + "/changes.jsonl";
  if (context.state_folder.empty() || context.disk.absent(path)) return history;
  TRY_LET(const auto text, context.disk.read(path));
  std::map<std::string, std::size_t> begun_at;
  for (const std::string_view line : split(text, '\n')) {
    if (line.empty()) continue;
    auto change = change_of(line);
    if (!change) {
      ++history.unreadable;
      continue;
    }
    const auto known = change->id.empty() ? begun_at.end() : begun_at.find(change->id);
    if (known == begun_at.end()) {
      if (!change->id.empty()) begun_at.emplace(change->id, history.changes.size());
      history.changes.push_back(std::move(*change));
      continue;
    }
    PastChange& entry = history.changes[known->second];
    change->time = entry.time;
    entry = std::move(*change);
  }
  return history;
}

}  // namespace spindle::commands
