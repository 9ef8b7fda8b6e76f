#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "files/profile_rules.hpp"
#include "spindle/base/ipv4.hpp"
#include "spindle/catalogue/encoding.hpp"

namespace spindle::files {
namespace {

using catalogue::DiscoverySpec;

// RFC 5771: addresses of groups begin with 1110.
constexpr std::uint32_t first_group = 0xE0000000;
constexpr std::uint32_t last_group = 0xEFFFFFFF;

void check_discovery(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.discovery) return;
  const DiscoverySpec& spec = *draft.profile.discovery;
  const auto add = [&](std::string_view key, std::string message) {
    findings.add_once(draft.discovery.of(key), std::move(message));
  };
  const auto group = parse_ipv4(spec.group);
  if (!group || *group < first_group || *group > last_group) {
    add("group",
        fmt::format("'{}' is no address of a group, 224.0.0.0 to 239.255.255.255", spec.group));
  }
  if (spec.port == 0) add("port", "a UDP port is 1 to 65535");
  if (spec.every <= Duration::zero()) add("every", "the time between two questions is above zero");
  struct Part {
    std::string_view key;
    catalogue::Slice slice;
    std::uint8_t most;  ///< bytes; 0: any
    std::uint8_t least = 1;
  };
  const std::array<Part, 8> parts = {{{"serial", spec.serial, 0},
                                      {"model", spec.model, 4},
                                      {"address", spec.address, 4, 4},
                                      {"tool-port", spec.tool_port, 2, 2},
                                      {"mac", spec.mac, 6, 6},
                                      {"firmware", spec.firmware, 4},
                                      {"in-use", spec.in_use, 4},
                                      {"kind", spec.kind, 4}}};
  for (const Part& part : parts) {
    if (part.slice.size == 0) continue;
    if (part.slice.offset + part.slice.size > spec.bytes) {
      add(part.key, fmt::format("an answer ends behind byte {}", spec.bytes - 1));
    }
    if (part.most != 0 && (part.slice.size > part.most || part.slice.size < part.least)) {
      add(part.key, part.least == part.most ? fmt::format("it has {} bytes", part.most)
                                            : fmt::format("it has at most {} bytes", part.most));
    }
  }
}

/// An answer to a read of the search must never look like an event.
void check_search(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events || !draft.profile.events->search) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  const catalogue::BlockSearch& search = *events.search;
  const auto add = [&](std::string message) {
    findings.add_once(draft.events.of("search"), std::move(message));
  };
  if (events.model != catalogue::EventModel::push) {
    add("what is searched for is an event that was pushed: 'source: push'");
  }
  if (search.step == 0) add("the step from one place to the next is above zero");
  if (search.count <= events.count || search.count > modbus::max_read_count) {
    add(fmt::format("a search reads more than {} registers at once, and at most {}", events.count,
                    modbus::max_read_count));
  }
  constexpr unsigned last_register = std::numeric_limits<std::uint16_t>::max();
  if (unsigned{search.to} + search.count > last_register + 1U) {
    add("the last place reaches behind the last register");
  }
  if (!is_catalogue_name(search.name)) {
    add(fmt::format("name '{}' is not made of lower-case words and numbers joined by '-' or '.'",
                    search.name));
  }
  const auto& actions = draft.profile.actions;
  if (std::any_of(actions.begin(), actions.end(),
                  [&](const auto& action) { return action.name == search.name; })) {
    add(fmt::format("'{}' is an action already", search.name));
  }
}

void check_learned_action(const ProfileDraft& draft, const catalogue::LearnedAction& action,
                          Diagnostics& findings) {
  const auto add = [&](std::string message) {
    findings.add_once(draft.learn.of("actions"), std::move(message));
  };
  if (!is_catalogue_name(action.name)) {
    add(fmt::format("name '{}' is not made of lower-case words and numbers joined by '-' or '.'",
                    action.name));
  }
  if (draft.lacks(action.follows)) {
    add(fmt::format("'{}' is no parameter of this profile", action.follows));
  }
  const auto found = draft.parameter_index.find(action.follows.to_string());
  if (found != draft.parameter_index.end()) {
    const auto& encoding = draft.profile.parameters[found->second].encoding;
    if (!encoding.is_integer() || catalogue::register_count(encoding) != 1) {
      add(fmt::format("{} is no number of one register", action.follows));
    }
  }
  const bool has_values = action.minimum < action.maximum || !action.labels.empty();
  if (action.by == catalogue::LearnedBy::value && !has_values) {
    add(fmt::format("{}: its 'range' or its 'labels' say which numbers may be given", action.name));
  }
}

void check_learning(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.learn) return;
  const catalogue::LearnSpec& learn = *draft.profile.learn;
  if (learn.table != modbus::RegisterTable::holding) {
    findings.add_once(draft.learn.of("table"), "commands are holding registers");
  }
  for (const catalogue::LearnedAction& action : learn.actions) {
    check_learned_action(draft, action, findings);
  }
}

}  // namespace

void check_finding_rules(const ProfileDraft& draft, Diagnostics& findings) {
  check_discovery(draft, findings);
  check_search(draft, findings);
  check_learning(draft, findings);
}

}  // namespace spindle::files
