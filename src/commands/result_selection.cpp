#include "result_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/base/text.hpp"
#include "spindle/work/store_place.hpp"
#include "stored_choice.hpp"

namespace spindle::commands {
namespace {

using store::Place;
using store::RowId;

/// What a name can be mistaken for.
std::vector<std::string> known_names(const StoredRecords& records, const files::Tools& tools) {
  std::vector<std::string> names;
  for (const Place& place : records.places()) names.push_back(place.name);
  for (const files::Tool& tool : tools.tools) names.push_back(tool.name);
  for (const auto& [group, members] : tools.groups) names.push_back("@" + group);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

class Selector {
 public:
  Selector(const ResultFilter& wanted, const StoredRecords& records, const Context& context)
      : wanted_(&wanted), records_(&records), context_(&context) {}

  Result<Selection> select() {
    return add_times(wanted_->since, wanted_->until, context_->clock, selection_.filter)
        .and_then([this] { return add_targets(); })
        .and_then([this] { return add_tools(); })
        .and_then([this] { return add_key(); })
        .map([this] {
          add_content();
          add_places();
          return std::move(selection_);
        });
  }

 private:
  [[nodiscard]] bool is_in_tools_file(const std::string& name) const {
    const auto& tools = context_->tools.tools;
    return std::any_of(tools.begin(), tools.end(), [&](auto& tool) { return tool.name == name; });
  }

  Result<void> add_target(const std::string& text) {
    bool is_known = false;
    for (const Place& place : records_->places()) {
      if (place.name != text && place.url != text) continue;
      is_known = true;
      selection_.names.insert(place.name);
      selection_.filter.places.push_back(place.id);
    }
    if (is_known) return {};
    if (!is_in_tools_file(text)) {
      return tl::unexpected(unknown_in_store(text, known_names(*records_, context_->tools)));
    }
    selection_.names.insert(text);
    context_->renderer.note(fmt::format("{}: nothing of it is stored", text));
    return {};
  }

  Result<void> add_targets() {
    const auto& groups = context_->tools.groups;
    for (const std::string& text : wanted_->targets) {
      std::vector<std::string> names = {text};
      if (names_group(text)) {
        const auto fault = context_->tools.faults.find(text);
        if (fault != context_->tools.faults.end()) return tl::unexpected(fault->second);
        const auto group = groups.find(text.substr(1));
        if (group == groups.end()) {
          return tl::unexpected(unknown_in_store(text, known_names(*records_, context_->tools)));
        }
        names = group->second;
      }
      for (const std::string& name : names) {
        TRY(add_target(name));
      }
    }
    const bool has_group = std::any_of(wanted_->targets.begin(), wanted_->targets.end(),
                                       [](const auto& text) { return names_group(text); });
    selection_.has_one_name = selection_.names.size() == 1 && !has_group;
    // An empty list asks for all, and there is no row 0.
    if (!wanted_->targets.empty() && selection_.filter.places.empty()) {
      selection_.filter.places = {0};
    }
    return {};
  }

  Result<void> add_tools() {
    for (const std::string& text : wanted_->tools) {
      std::set<RowId> found;
      for (const store::Tool& tool : records_->tools()) {
        if (tool.name.serial == text) found.insert(tool.id);
      }
      for (const Place& place : records_->places()) {
        if (place.name == text || place.url == text) found.insert(place.tool);
      }
      if (found.empty()) {
        std::vector<std::string> known = known_names(*records_, {});
        for (const store::Tool& tool : records_->tools()) known.push_back(tool.name.serial);
        return tl::unexpected(unknown_in_store(text, std::move(known)));
      }
      selection_.filter.tools.insert(selection_.filter.tools.end(), found.begin(), found.end());
    }
    return {};
  }

  Result<void> add_key() {
    const std::string& key = wanted_->key;
    if (key.empty()) return {};
    const std::size_t second = key.rfind('/');
    const std::size_t first =
        second == std::string::npos || second == 0 ? std::string::npos : key.rfind('/', second - 1);
    const auto refuse = [&] {
      return tl::unexpected(
          bad_option("--key", fmt::format("'{}' names no result", key),
                     "write SERIAL/EPOCH/NUMBER as JSON has them: 1021100042/0/1962"));
    };
    if (first == std::string::npos) return refuse();
    const auto epoch =
        parse_unsigned(std::string_view(key).substr(first + 1, second - first - 1), 1'000'000'000);
    const auto number = parse_unsigned(std::string_view(key).substr(second + 1), 65'535);
    if (!epoch || !number) return refuse();
    selection_.filter.epoch = static_cast<std::int64_t>(*epoch);
    selection_.filter.number = static_cast<std::uint16_t>(*number);
    std::vector<std::string> serials;
    for (const store::Tool& tool : records_->tools()) {
      if (tool.name.serial == key.substr(0, first)) selection_.filter.tools.push_back(tool.id);
      serials.push_back(tool.name.serial);
    }
    if (selection_.filter.tools.empty()) {
      return tl::unexpected(unknown_in_store(key.substr(0, first), std::move(serials)));
    }
    return {};
  }

  void add_content() {
    selection_.filter.preset = wanted_->preset;
    selection_.filter.kinds = wanted_->kinds;
    selection_.is_about_content =
        wanted_->preset || !wanted_->kinds.empty() || !wanted_->key.empty();
    selection_.is_whole = !selection_.is_about_content && wanted_->targets.empty() &&
                          wanted_->tools.empty() && !selection_.filter.since &&
                          !selection_.filter.until;
  }

  void add_places() {
    const store::Filter& filter = selection_.filter;
    const auto has = [](const std::vector<RowId>& ids, RowId id) {
      return ids.empty() || std::find(ids.begin(), ids.end(), id) != ids.end();
    };
    for (const Place& place : records_->places()) {
      if (has(filter.places, place.id) && has(filter.tools, place.tool)) {
        selection_.places.push_back(&place);
      }
    }
  }

  const ResultFilter* wanted_;
  const StoredRecords* records_;
  const Context* context_;
  Selection selection_ = {};
};

}  // namespace

Result<Selection> select_results(const ResultFilter& wanted, const StoredRecords& records,
                                 const Context& context) {
  return Selector(wanted, records, context).select();
}

Result<std::unique_ptr<store::Reader>> open_store(const std::string& named,
                                                  const Context& context) {
  return work::store_place(named, context.state_folder).and_then(&store::Reader::open);
}

}  // namespace spindle::commands
