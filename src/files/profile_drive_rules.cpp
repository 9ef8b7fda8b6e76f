#include <fmt/format.h>

#include "files/profile_rules.hpp"

namespace spindle::files {
namespace {

class DriveRules {
 public:
  DriveRules(const ProfileDraft& draft, Diagnostics& findings)
      : draft_(draft), findings_(findings) {}

  void check() {
    if (draft_.profile.refusals) check_refusals(*draft_.profile.refusals);
    check_lists();
    for (std::size_t i = 0; i < draft_.parameters.size(); ++i) {
      check_parameter(draft_.profile.parameters[i], draft_.parameters[i]);
    }
    for (std::size_t i = 0; i < draft_.actions.size(); ++i) {
      check_action(draft_.profile.actions[i], draft_.actions[i]);
    }
  }

 private:
  const catalogue::Parameter* known(const std::string& name) const {
    const auto found = draft_.parameter_index.find(name);
    return found == draft_.parameter_index.end() ? nullptr
                                                 : &draft_.profile.parameters[found->second];
  }

  const catalogue::Parameter* require(const std::string& name, const SourceLocation& at) {
    const catalogue::Parameter* parameter = known(name);
    if (draft_.lacks(name)) {
      findings_.add_once(at, fmt::format("'{}' is no parameter of this profile", name));
    }
    return parameter;
  }

  void check_refusals(const catalogue::ExtendedErrorSpec& refusals) {
    require(refusals.parameter, draft_.refusals.of("parameter"));
    for (const std::int64_t code : refusals.busy) {
      if (refusals.codes.contains(code)) continue;
      findings_.add_once(draft_.refusals.of("busy"), fmt::format("code {} has no text", code));
    }
    const bool waits = refusals.retry_every > Duration::zero();
    if (!refusals.busy.empty() && !waits) {
      findings_.add_once(draft_.refusals.of("retry-every"), "waiting needs a time above zero");
    }
  }

  void check_lists() {
    // A pattern may mean what could not be read.
    if (draft_.incomplete || !draft_.half_read.empty()) return;
    for (const catalogue::AlarmList& list : draft_.profile.alarm_lists) {
      if (const auto found = draft_.profile.select(to_strings(list.parameters)); !found) {
        findings_.add_once(
            draft_.alarm_lists.entry->at,
            fmt::format("{}: {}: {}", list.name, found.error().name, message_of(found.error())));
      }
      if (list.codes == catalogue::CodeTable::refusal && draft_.refusals.entry == nullptr) {
        findings_.add_once(draft_.alarm_lists.entry->at,
                           fmt::format("{}: the profile has no refusals", list.name));
      }
    }
    if (draft_.profile.watched.empty()) return;
    if (const auto found = draft_.profile.select(to_strings(draft_.profile.watched)); !found) {
      findings_.add_once(draft_.watched.entry->at,
                         fmt::format("{}: {}", found.error().name, message_of(found.error())));
    }
  }

  void check_parameter(const catalogue::Parameter& parameter, const Origin& origin) {
    check_bits(parameter, origin);
    check_except(parameter, origin);
    if (parameter.effect && parameter.access == catalogue::Access::read_only) {
      findings_.add_once(origin.of("effect"),
                         fmt::format("{}: what is read-only has no effect", parameter.name));
    }
  }

  void check_bits(const catalogue::Parameter& parameter, const Origin& origin) {
    const catalogue::BitSlice& slice = parameter.encoding.slice;
    const unsigned width =
        slice.is_whole() ? catalogue::register_count(parameter.encoding) * 16U : slice.width;
    if (!parameter.bits_by.empty()) require(parameter.bits_by, origin.of("bits-by"));
    for (std::size_t i = 0; i < parameter.bits.size(); ++i) {
      const catalogue::BitName& bit = parameter.bits[i];
      if (unsigned{bit.bit} + bit.width > width) {
        findings_.add_once(origin.of("bits"),
                           fmt::format("{}: bit {} is behind the last", parameter.name, bit.bit));
      }
      if (bit.text.empty() || bit.text.view().find_first_of("+, ") != std::string_view::npos) {
        findings_.add_once(origin.of("bits"),
                           fmt::format("{}: '{}' is no name of a bit", parameter.name, bit.text));
      }
      for (std::size_t j = 0; j < i; ++j) check_pair(parameter, parameter.bits[j], bit, origin);
    }
    const bool unsuitable = parameter.encoding.scale != Decimal(1) || !parameter.labels.empty();
    if (!parameter.bits.empty() && unsuitable) {
      findings_.add_once(origin.of("bits"), fmt::format("{}: a bit field has neither scale nor "
                                                        "labels",
                                                        parameter.name));
    }
  }

  /// Two names that count at the same time need two bits, and differ.
  void check_pair(const catalogue::Parameter& parameter, const catalogue::BitName& a,
                  const catalogue::BitName& b, const Origin& origin) {
    const bool together = !a.when || !b.when || a.when == b.when;
    const bool meet = a.bit < b.bit + b.width && b.bit < a.bit + a.width;
    if (!together || (!meet && a.text != b.text)) return;
    findings_.add_once(origin.of("bits"), fmt::format("{}: bit {} and name '{}' are there twice",
                                                      parameter.name, b.bit, b.text));
  }

  void check_except(const catalogue::Parameter& parameter, const Origin& origin) {
    if (!parameter.except) return;
    const auto& [low, high] = *parameter.except;
    const auto& [minimum, maximum] = parameter.range;
    const bool inside =
        *low <= *high && (!minimum || *low > *minimum) && (!maximum || *high < *maximum);
    if (inside) return;
    findings_.add_once(origin.of("except"), fmt::format("{}: what is excepted is not inside its "
                                                        "range",
                                                        parameter.name));
  }

  void check_action(const catalogue::Action& action, const Origin& origin) {
    const bool pulses = action.rest.has_value();
    if (pulses && (!action.value || action.value == action.rest)) {
      findings_.add_once(origin.of("rest"),
                         fmt::format("{}: rest needs a value that differs from it", action.name));
    }
    if (action.motion != catalogue::Motion::none && !has_command_word()) {
      findings_.add_once(origin.of("motion"),
                         fmt::format("{}: a motion needs the section 'run'", action.name));
    }
    if (action.busy > Duration::zero() && !tells_busy()) {
      findings_.add_once(origin.of("busy"), fmt::format("{}: no status in the section 'run' says "
                                                        "that it is busy",
                                                        action.name));
    }
    const bool pair = catalogue::register_count(action.encoding) == 2;
    if (pair && draft_.profile.link.even_pairs && action.address.value % 2 != 0) {
      findings_.add_once(origin.of("register"),
                         fmt::format("{}: a 32-bit value begins at an odd register, {}",
                                     action.name, action.address.value));
    }
  }

  /// The words of a motion are those of a command word.
  [[nodiscard]] bool has_command_word() const {
    if (draft_.run.entry == nullptr) return false;
    return !draft_.profile.run || draft_.profile.run->word() != nullptr;
  }

  [[nodiscard]] bool tells_busy() const {
    if (has_command_word()) return true;
    const auto& run = draft_.profile.run;
    const auto* command = run ? run->command_register() : nullptr;
    return command != nullptr && command->monitor.busy.has_value();
  }

  const ProfileDraft& draft_;
  Diagnostics& findings_;
};

}  // namespace

void check_drive_rules(const ProfileDraft& draft, Diagnostics& findings) {
  DriveRules(draft, findings).check();
}

}  // namespace spindle::files
