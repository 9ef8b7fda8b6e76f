#include "complete.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "grammar.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/link/endpoint.hpp"
#include "spindle/sim/fault_plan.hpp"
#include "spindle/sim/outage.hpp"

namespace spindle::cli {
namespace {

/// More names than this are offered head by head, as folders are.
constexpr std::size_t many_names = 40;

using catalogue::Parameter;
using catalogue::Profile;

/// An argument in a command's synopsis.
struct Slot {
  std::string name;  ///< "TARGET", "NAME=VALUE"
  bool is_optional = false;
  bool repeats = false;
  std::string option = {};  ///< stands instead of it; empty: none does
};

/// Where the first word ends: at a blank outside of brackets and braces.
std::size_t word_end(std::string_view synopsis) {
  std::size_t depth = 0;
  for (std::size_t at = 0; at < synopsis.size(); ++at) {
    const char c = synopsis[at];
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (c == ' ' && depth == 0) return at;
  }
  return synopsis.size();
}

/// What stands in braces: an argument, or an option instead, as in "FILE|--dir FOLDER".
Slot choice_of(std::string_view choice) {
  const std::size_t bar = choice.find("|--");
  const std::string_view option = choice.substr(bar + 1);
  return {.name = std::string(choice.substr(0, bar)),
          .option = std::string(option.substr(0, option.find(' ')))};
}

/// "TARGET... [NAME|PATTERN...] [--count N]" has two; bracketed options are none.
std::vector<Slot> slots_of(std::string_view synopsis) {
  std::vector<Slot> slots;
  while (!synopsis.empty()) {
    const bool is_optional = synopsis.front() == '[';
    const std::size_t end = word_end(synopsis);
    std::string_view word = synopsis.substr(0, end);
    synopsis.remove_prefix(std::min(end + 1, synopsis.size()));
    if (word.starts_with('{')) {
      slots.push_back(choice_of(word.substr(1, word.size() - 2)));
      continue;
    }
    if (is_optional) word = word.substr(1, word.size() - 2);
    const bool repeats = word.ends_with("...");
    if (repeats) word.remove_suffix(3);
    if (!word.starts_with('-')) slots.push_back({std::string(word), is_optional, repeats});
  }
  return slots;
}

/// Places of slots; one behind the last is the end.
using Places = std::set<std::size_t>;

/// With those that are reached by leaving out what is optional.
Places past_optional(const std::vector<Slot>& slots, Places places) {
  for (std::size_t at = 0; at < slots.size(); ++at) {
    if (places.contains(at) && slots[at].is_optional) places.insert(at + 1);
  }
  return places;
}

/// Where the next argument may stand when one stands in any of these.
Places behind(const std::vector<Slot>& slots, const Places& places) {
  Places next;
  for (const std::size_t at : places) {
    if (at == slots.size()) continue;
    if (slots[at].repeats) next.insert(at);
    next.insert(at + 1);
  }
  return past_optional(slots, std::move(next));
}

/// Slots in which the argument behind `given` others may stand.
std::vector<Slot> possible_slots(const std::vector<Slot>& slots, std::size_t given) {
  Places places = past_optional(slots, {0});
  for (std::size_t argument = 0; argument < given; ++argument) places = behind(slots, places);
  places.erase(slots.size());
  std::vector<Slot> possible;
  possible.reserve(places.size());
  for (const std::size_t at : places) possible.push_back(slots[at]);
  return possible;
}

/// What the words before the last one say.
struct Typed {
  const CommandDescription* command = nullptr;
  std::vector<std::string> arguments = {};
  const OptionDescription* awaits_value = nullptr;
  std::string profile = {};          ///< of --profile
  std::set<std::string> given = {};  ///< options that take a value, by their last names
  bool options_ended = false;
};

class Completer {
 public:
  Completer(const Description& description, const CompletionSources& nameable)
      : description_(&description), nameable_(&nameable) {}

  Completion run(const std::vector<std::string>& words) {
    for (std::size_t at = 0; at + 1 < words.size(); ++at) read(words[at]);
    const std::string word = words.empty() ? std::string() : words.back();
    offer(word);
    std::erase_if(found_.candidates,
                  [&](const Candidate& candidate) { return !candidate.text.starts_with(word); });
    return std::move(found_);
  }

 private:
  // ---- the words before ----

  void read(const std::string& word) {
    if (typed_.awaits_value != nullptr) {
      note_value(*std::exchange(typed_.awaits_value, nullptr), word);
    } else if (word == "--" && !typed_.options_ended) {
      typed_.options_ended = true;
    } else if (word.size() > 1 && word.front() == '-' && !typed_.options_ended) {
      read_option(word);
    } else if (const CommandDescription* command = find_command_below(word)) {
      typed_.command = command;
    } else {
      typed_.arguments.push_back(word);
    }
  }

  void read_option(const std::string& word) {
    const std::size_t equals = word.find('=');
    const OptionDescription* option = find_option(word.substr(0, equals));
    if (option == nullptr || option->is_flag()) return;
    typed_.given.insert(option->names.back());
    if (equals == std::string::npos) {
      typed_.awaits_value = option;
    } else {
      note_value(*option, word.substr(equals + 1));
    }
  }

  void note_value(const OptionDescription& option, const std::string& value) {
    if (option.names.back() == "--profile") typed_.profile = value;
  }

  [[nodiscard]] const CommandDescription* find_command_below(const std::string& word) const {
    if (!typed_.arguments.empty()) return nullptr;
    if (typed_.command == nullptr) return find_command(*description_, word);
    if (typed_.command->commands.empty()) return nullptr;
    return find_command(*description_, typed_.command->name + " " + word);
  }

  [[nodiscard]] const OptionDescription* find_option(std::string_view name) const {
    for (const auto* options : option_lists()) {
      for (const OptionDescription& option : *options) {
        const auto& names = option.names;
        if (std::find(names.begin(), names.end(), name) != names.end()) return &option;
      }
    }
    return nullptr;
  }

  [[nodiscard]] std::vector<const std::vector<OptionDescription>*> option_lists() const {
    std::vector<const std::vector<OptionDescription>*> lists = {&description_->common};
    if (typed_.command != nullptr) lists.insert(lists.begin(), &typed_.command->options);
    return lists;
  }

  // ---- the last word ----

  void offer(const std::string& word) {
    const std::size_t equals = word.find('=');
    if (typed_.awaits_value != nullptr) return offer_value(*typed_.awaits_value, "");
    if (word.starts_with('-') && !typed_.options_ended) {
      if (equals == std::string::npos) return offer_options();
      const OptionDescription* option = find_option(word.substr(0, equals));
      if (option != nullptr) offer_value(*option, word.substr(0, equals + 1));
      return;
    }
    if (typed_.command == nullptr) return offer_commands(description_->commands);
    if (!typed_.command->commands.empty()) return offer_commands(typed_.command->commands);
    std::vector<Slot> slots = slots_of(typed_.command->synopsis);
    std::erase_if(slots, [&](const Slot& slot) { return typed_.given.contains(slot.option); });
    for (const Slot& slot : possible_slots(slots, typed_.arguments.size())) {
      offer_argument(slot, word);
    }
  }

  void offer_options() {
    for (const auto* options : option_lists()) {
      for (const OptionDescription& option : *options) {
        if (option.is_argument() || !is_declared(option)) continue;
        add(option.names.back(), option.meaning);
      }
    }
  }

  /// Whether the profile of the tool that was typed has such an option; yes where it is not known.
  [[nodiscard]] bool is_declared(const OptionDescription& option) const {
    if (option.declared_by.empty()) return true;
    const bool simulates = typed_.command->name == "simulate";
    const auto profile = simulates ? profile_argument() : profile_of_target();
    if (!profile) return true;
    const auto declared =
        simulates ? commands::simulate_options(*profile) : commands::start_options(*profile);
    return std::find(declared.begin(), declared.end(), option.names.back()) != declared.end();
  }

  [[nodiscard]] std::optional<Profile> profile_argument() const {
    if (typed_.arguments.empty()) return std::nullopt;
    auto profile = nameable_->profiles.load(typed_.arguments.front());
    return profile ? std::optional(std::move(*profile)) : std::nullopt;
  }

  void offer_commands(const std::vector<CommandDescription>& commands) {
    for (const CommandDescription& command : commands) {
      add(command.name.substr(command.name.rfind(' ') + 1), command.meaning);
    }
  }

  template <typename Table>
  static std::vector<Candidate> candidates_of(const Table& table) {
    std::vector<Candidate> words;
    for (std::string& word : table.words()) words.push_back({std::move(word), ""});
    return words;
  }

  void offer_value(const OptionDescription& option, const std::string& before) {
    const std::string& kind = option.placeholder;
    std::vector<Candidate> values;
    if (kind == "FORMAT") values = candidates_of(format_words);
    if (kind == "WHEN") values = candidates_of(color_words);
    if (kind == "RULES") values = candidates_of(rule_set_words);
    if (kind == "WHAT") values = candidates_of(included_words);
    if (kind == "STUDY") values = candidates_of(study_words);
    if (kind == "NUMBERING") values = candidates_of(files::numbering_words);
    if (kind == "TABLE") values = candidates_of(modbus::table_words);
    if (kind == "KIND") values = candidates_of(catalogue::event_kind_words);
    if (kind == "NAME|FILE") values = profiles();
    if (kind == "FAULT") values = faults();
    if (kind == "OUTAGE") values = outages();
    if (kind.find("FILE") != std::string::npos) found_.paths = Paths::files;
    if (kind == "FOLDER" || kind == "DIR") found_.paths = Paths::folders;
    for (const Candidate& value : values) add(before + value.text, value.meaning);
  }

  void offer_argument(const Slot& slot, const std::string& word) {
    const bool is_side = slot.name == "A" || slot.name == "B";  // of a comparison
    if (slot.name == "TARGET" || slot.name == "BUS" || is_side) {
      offer_tools(word);
      offer_groups(slot.repeats || find_option("--jobs") != nullptr ? Groups::all : Groups::of_one);
    }
    if (is_side) add("defaults", "what the profile says");
    if (slot.name == "FILE" || is_side) found_.paths = Paths::files;
    if (slot.name == "PROFILE") offer_profiles();
    if (slot.name == "COMMAND") offer_commands(description_->commands);
    if (typed_.command->name == "tools add") return;  // a name that is not there yet
    if (slot.name == "PATTERN" || slot.name.starts_with("NAME") ||
        slot.name.starts_with("ACTION") || slot.name == "WHAT") {
      offer_of_profile(slot, word);
    }
  }

  void offer_profiles() {
    for (const Candidate& profile : profiles()) add(profile.text, profile.meaning);
    if (typed_.command->name.starts_with("profile")) found_.paths = Paths::files;
  }

  void offer_of_profile(const Slot& slot, const std::string& word) {
    const auto profile = profile_of_target();
    if (!profile) return;
    if (slot.name.starts_with("ACTION")) return offer_actions(*profile, word);
    if (slot.name == "WHAT") return offer_learned(*profile);
    if (slot.name == "NAME=VALUE") return offer_assignments(*profile, word);
    offer_names(names_of(*profile), word);
  }

  void offer_tools(const std::string& word) {
    for (const files::Tool& tool : nameable_->tools.tools) {
      if (!nameable_->tools.faults.contains(tool.name)) add(tool.name, tool.url);
    }
    if (!word.starts_with("sim:")) return add("sim:", "a simulated tool");
    for (const Candidate& profile : profiles()) add("sim:" + profile.text, "a simulated tool");
  }

  /// Which groups a command takes: one that takes a single tool takes a group of one.
  enum class Groups : std::uint8_t { of_one, all };

  void offer_groups(Groups taken) {
    for (const auto& [group, members] : nameable_->tools.groups) {
      if (taken == Groups::of_one && members.size() > 1) continue;
      if (nameable_->tools.faults.contains("@" + group)) continue;
      add("@" + group, counted(members.size(), "tool"));
    }
  }

  /// Labels behind "NAME=", else the names that can be set.
  void offer_assignments(const Profile& profile, const std::string& word) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos) {
      std::vector<Candidate> names;
      const catalogue::Dangers dangers(profile);
      for (const Parameter& parameter : profile.parameters) {
        const bool read_only = parameter.access == catalogue::Access::read_only;
        if (read_only || dangers.find(parameter)) continue;
        names.push_back({parameter.name + "=", parameter.title});
      }
      return offer_names(std::move(names), word);
    }
    const auto parameter = profile.find(word.substr(0, equals));
    if (parameter) offer_labels(parameter->labels, word.substr(0, equals + 1));
  }

  void offer_actions(const Profile& profile, const std::string& word) {
    const std::size_t equals = word.find('=');
    const auto& events = profile.events;
    if (events && events->search) {
      add(events->search->name.to_string(), events->search->title.to_string());
    }
    for (const catalogue::Action& action : profile.actions) {
      const bool takes_value = !action.value;
      if (equals == std::string::npos) {
        add(action.name + (takes_value ? "=" : ""), action.title);
      } else if (action.name == word.substr(0, equals)) {
        offer_labels(action.labels, word.substr(0, equals + 1));
      }
    }
  }

  /// What a tool of this profile can show itself.
  void offer_learned(const Profile& profile) {
    if (!profile.learn) return;
    for (const catalogue::LearnedAction& action : profile.learn->actions) {
      add(action.name.to_string(), action.title.to_string());
    }
  }

  void offer_labels(const catalogue::List<catalogue::Label>& labels, const std::string& before) {
    for (const catalogue::Label& label : labels) {
      add(before + label.text, std::to_string(label.number));
    }
  }

  static std::vector<Candidate> names_of(const Profile& profile) {
    std::vector<Candidate> names;
    names.reserve(profile.parameters.size());
    for (const Parameter& parameter : profile.parameters) {
      if (profile.consumes(parameter)) continue;  // who names it is refused
      names.push_back({parameter.name, parameter.title});
    }
    return names;
  }

  /// "preset." rather than hundreds of names that begin with it.
  void offer_names(std::vector<Candidate> names, const std::string& word) {
    std::erase_if(names, [&](const Candidate& name) { return !name.text.starts_with(word); });
    if (names.size() > many_names) {
      std::vector<Candidate> heads;
      for (Candidate& name : names) {
        const std::size_t dot = name.text.find('.', word.size());
        if (dot != std::string::npos) name = {name.text.substr(0, dot + 1), ""};
        const bool is_known = !heads.empty() && heads.back().text == name.text;
        if (!is_known) heads.push_back(std::move(name));
      }
      names = std::move(heads);
    }
    for (Candidate& name : names) add(std::move(name.text), std::move(name.meaning));
  }

  [[nodiscard]] std::vector<Candidate> profiles() const {
    std::vector<Candidate> names;
    for (const files::ProfileEntry& entry : nameable_->profiles.list()) {
      names.push_back({entry.id, entry.path});
    }
    return names;
  }

  static std::vector<Candidate> faults() {
    std::vector<Candidate> kinds;
    for (const sim::FaultHelp& fault : sim::fault_help()) {
      kinds.push_back({std::string(sim::to_text(fault.kind)), std::string(fault.meaning)});
    }
    return kinds;
  }

  static std::vector<Candidate> outages() {
    std::vector<Candidate> kinds;
    for (const sim::OutageHelp& outage : sim::outage_help()) {
      const std::string kind = outage.syntax.substr(0, outage.syntax.find('=') + 1);
      kinds.push_back({kind, std::string(outage.meaning)});
    }
    return kinds;
  }

  /// The tools that an argument means, by their names or URLs.
  [[nodiscard]] std::vector<std::string> members_of(const std::string& argument) const {
    const auto& groups = nameable_->tools.groups;
    const auto group = argument.starts_with('@') ? groups.find(argument.substr(1)) : groups.end();
    return group == groups.end() ? std::vector<std::string>{argument} : group->second;
  }

  /// By the tools file, or because the target is simulated.
  [[nodiscard]] std::string profile_of(const std::string& name) const {
    const auto& tools = nameable_->tools.tools;
    const auto tool = std::find_if(tools.begin(), tools.end(),
                                   [&](const files::Tool& one) { return one.name == name; });
    if (tool != tools.end() && !tool->profile.empty()) return tool->profile;
    const auto endpoint = link::parse_endpoint(tool == tools.end() ? name : tool->url);
    if (!endpoint || !endpoint->profile.empty() || nameable_->memory == nullptr) {
      return endpoint ? endpoint->profile : std::string();
    }
    const auto seen = nameable_->memory->recall(*endpoint);
    return seen && *seen ? (*seen)->profile : std::string();
  }

  [[nodiscard]] bool is_target(const std::string& argument) const {
    const auto& tools = nameable_->tools.tools;
    return argument.starts_with('@') || link::looks_like_url(argument) ||
           std::any_of(tools.begin(), tools.end(),
                       [&](const files::Tool& tool) { return tool.name == argument; });
  }

  /// What was typed, or what is meant where no tool was.
  [[nodiscard]] std::vector<std::string> targets() const {
    std::vector<std::string> named;
    for (const std::string& argument : typed_.arguments) {
      if (is_target(argument)) named.push_back(argument);
    }
    if (named.empty() && !nameable_->usual_target.empty()) return {nameable_->usual_target};
    return named;
  }

  /// By --profile, else that of the first tool which has one.
  [[nodiscard]] std::optional<Profile> profile_of_target() const {
    std::string name = typed_.profile;
    for (const std::string& target : targets()) {
      for (const std::string& member : members_of(target)) {
        if (name.empty()) name = profile_of(member);
      }
    }
    if (name.empty()) return std::nullopt;
    auto profile = nameable_->profiles.load(name);
    return profile ? std::optional(std::move(*profile)) : std::nullopt;
  }

  void add(std::string text, std::string meaning) {
    found_.candidates.push_back({std::move(text), std::move(meaning)});
  }

  const Description* description_;
  const CompletionSources* nameable_;
  Typed typed_ = {};
  Completion found_ = {};
};

}  // namespace

Completion complete(const std::vector<std::string>& words, const Description& description,
                    const CompletionSources& nameable) {
  return Completer(description, nameable).run(words);
}

std::string to_text(const Completion& completion) {
  constexpr auto path_words = enum_table<Paths>(
      {{"none", Paths::none}, {"files", Paths::files}, {"folders", Paths::folders}});
  std::string text = fmt::format("{}\n", path_words.text(completion.paths));
  for (const Candidate& candidate : completion.candidates) {
    text += fmt::format("{}\t{}\n", candidate.text, candidate.meaning);
  }
  return text;
}

}  // namespace spindle::cli
