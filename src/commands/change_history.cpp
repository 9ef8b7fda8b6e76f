#include "change_history.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
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

template <std::size_t count>
bool is_one_of(const std::array<std::string_view, count>& results, const PastChange& change) {
  return std::find(results.begin(), results.end(), change.result) != results.end();
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

std::string run_of(const std::string& id) {
  constexpr std::size_t digits = 8;
  const std::size_t first = id.find('-');
  const bool is_short = first == digits && std::all_of(id.begin(), id.begin() + digits, [](char c) {
                          return std::isxdigit(static_cast<unsigned char>(c)) != 0;
                        });
  return id.substr(0, is_short ? first : id.rfind('-'));
}

bool has_changed(const PastChange& change) {
  return is_one_of<3>({"written", "coerced", "changed-along"}, change);
}

bool may_have_changed(const PastChange& change) {
  if (has_changed(change)) return true;
  return change.before != report::Cell() &&
         is_one_of<4>({"mismatch", "unknown", files::begun, "not-rolled-back"}, change);
}

std::string value_of(const PastChange& change) {
  return fmt::format("{}\n{}\n{}\n{}", run_of(change.id), change.target, change.serial,
                     change.name);
}

std::set<std::string> taken_back(const ChangeHistory& history) {
  std::map<std::string, const PastChange*> earlier;
  std::set<std::string> taken;
  for (const PastChange& change : history.changes) {
    bool is_taken = true;
    auto other = has_changed(change) ? earlier.find(change.undoes) : earlier.end();
    for (std::size_t steps = 0; other != earlier.end() && steps < earlier.size(); ++steps) {
      const std::string value = value_of(*other->second);
      is_taken ? static_cast<void>(taken.insert(value)) : static_cast<void>(taken.erase(value));
      is_taken = !is_taken;
      other = earlier.find(other->second->undoes);
    }
    if (!change.id.empty()) earlier.emplace(change.id, &change);
  }
  return taken;
}

}  // namespace spindle::commands
