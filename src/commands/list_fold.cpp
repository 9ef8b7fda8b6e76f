#include "list_fold.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

using report::Record;

/// Fewer are no family.
constexpr std::size_t least_folded = 3;

/// A name with one number in it: "preset." 3 ".speed".
struct Numbered {
  std::string head;
  std::uint64_t number = 0;
  std::string tail;
};

std::optional<Numbered> numbered(std::string_view name) {
  std::optional<Numbered> found;
  std::size_t at = 0;
  for (const std::string_view part : split(name, '.')) {
    if (const auto number = parse_unsigned(part, UINT16_MAX)) {
      if (found) return std::nullopt;
      found = Numbered{std::string(name.substr(0, at)), *number,
                       std::string(name.substr(at + part.size()))};
    }
    at += part.size() + 1;
  }
  return found;
}

std::string text_of(const Record& record, std::string_view key) {
  const report::Field* const field = record.find(key);
  if (field == nullptr) return {};
  return field->shown.empty() ? report::to_text(field->cell) : field->shown;
}

/// What has to be the same of all that become one.
std::string looks_of(const Record& record) {
  std::string looks;
  for (const char* key :
       {"title", "table", "encoding", "unit", "minimum", "maximum", "access", "effect"}) {
    looks += text_of(record, key) + '\n';
  }
  return looks;
}

void set(Record& record, std::string_view key, std::string text) {
  for (report::Field& field : record.fields) {
    if (field.key == key) field.shown = std::move(text);
  }
}

/// Records that differ in their number alone, by their places in the list.
struct Family {
  Numbered first;
  std::vector<std::size_t> members = {};
};

class Folding {
 public:
  explicit Folding(std::vector<Record> records) : records_(std::move(records)) {
    for (std::size_t at = 0; at < records_.size(); ++at) add(at);
  }

  FoldedList fold() {
    std::vector<bool> is_told(records_.size(), false);
    FoldedList list;
    for (std::size_t at = 0; at < records_.size(); ++at) {
      if (is_told[at]) continue;
      const Family* const family = family_of_[at];
      if (family != nullptr && family->members.size() >= least_folded) {
        fold(*family, list);
        for (const std::size_t member : family->members) is_told[member] = true;
      }
      list.records.push_back(std::move(records_[at]));
    }
    return list;
  }

 private:
  /// One behind the last one of its family, or the first of a new one.
  void add(std::size_t at) {
    family_of_.push_back(nullptr);
    const auto name = numbered(text_of(records_[at], "name"));
    if (!name) return;
    Family& family =
        families_[fmt::format("{}*{}\n{}", name->head, name->tail, looks_of(records_[at]))];
    if (family.members.empty()) family.first = *name;
    if (family.first.number + family.members.size() != name->number) return;
    family.members.push_back(at);
    family_of_[at] = &family;
  }

  void fold(const Family& family, FoldedList& list) {
    const Numbered& name = family.first;
    const std::string numbers =
        fmt::format("{}-{}", name.number, name.number + family.members.size() - 1);
    const std::string head = name.head + numbers;
    const bool is_known =
        std::find(list.folded.begin(), list.folded.end(), head) != list.folded.end();
    if (!is_known) list.folded.push_back(head);
    Record& first = records_[family.members.front()];
    const Record& last = records_[family.members.back()];
    set(first, "name", head + name.tail);
    set(first, "register",
        fmt::format("{}..{}", text_of(first, "register"), text_of(last, "register")));
    std::string evidence;
    for (const std::size_t member : family.members) {
      const std::string own = text_of(records_[member], "evidence");
      if (evidence.find(own) != std::string::npos) continue;
      evidence += (evidence.empty() ? "" : ", ") + own;
    }
    set(first, "evidence", std::move(evidence));
  }

  std::vector<Record> records_;
  std::map<std::string, Family> families_ = {};
  std::vector<const Family*> family_of_ = {};  ///< of each record; null: it is alone
};

}  // namespace

FoldedList fold(std::vector<Record> records) { return Folding(std::move(records)).fold(); }

}  // namespace spindle::commands
