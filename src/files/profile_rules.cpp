#include "files/profile_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <limits>

#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"
#include "spindle/catalogue/unit.hpp"
#include "spindle/catalogue/value.hpp"
#include "spindle/catalogue/write_order.hpp"

namespace spindle::files {
namespace {

using catalogue::Access;
using catalogue::Action;
using catalogue::Label;
using catalogue::Parameter;
using modbus::RegisterTable;

constexpr unsigned last_register = std::numeric_limits<std::uint16_t>::max();

bool is_word_character(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); }

/// Registers that one parameter occupies.
struct Span {
  RegisterTable table;
  unsigned first;
  unsigned last;
  std::size_t index;  ///< of the parameter
};

Span span_of(const Parameter& parameter, std::size_t index) {
  const unsigned first = parameter.address.value;
  return {parameter.table, first, first + catalogue::register_count(parameter.encoding) - 1U,
          index};
}

template <typename Visit>
void for_each_parameter(const ProfileDraft& draft, const Visit& visit) {
  for (std::size_t i = 0; i < draft.parameters.size(); ++i) {
    visit(draft.profile.parameters[i], draft.parameters[i]);
  }
}

template <typename Visit>
void for_each_action(const ProfileDraft& draft, const Visit& visit) {
  for (std::size_t i = 0; i < draft.actions.size(); ++i) {
    visit(draft.profile.actions[i], draft.actions[i]);
  }
}

const Parameter* parameter_named(const ProfileDraft& draft, const std::string& name) {
  const auto found = draft.parameter_index.find(name);
  return found == draft.parameter_index.end() ? nullptr : &draft.profile.parameters[found->second];
}

std::string no_such_parameter(const ProfileDraft& draft, const std::string& name) {
  std::vector<std::string> names;
  for (const Parameter& parameter : draft.profile.parameters) names.push_back(parameter.name);
  const std::string hint = suggestion(name, names);
  return fmt::format("'{}' is no parameter of this profile{}{}", name, hint.empty() ? "" : "; ",
                     hint);
}

// ---- names ----

void id_is_the_file_name(const ProfileDraft& draft, Diagnostics& findings) {
  const catalogue::Profile& profile = draft.profile;
  const std::string stem = std::filesystem::path(profile.path.view()).stem().string();
  if (!is_catalogue_name(profile.id)) {
    findings.add_once(draft.top.of("id"),
                      fmt::format("id '{}' is not made of lower-case words and numbers joined by "
                                  "'-' or '.'",
                                  profile.id));
  } else if (profile.id != stem) {
    findings.add_once(draft.top.of("id"),
                      fmt::format("id '{}' differs from the file name '{}'", profile.id, stem));
  }
}

void names_have_the_pattern(const ProfileDraft& draft, Diagnostics& findings) {
  const auto check = [&](const std::string& name, const Origin& origin) {
    if (is_catalogue_name(name)) return;
    findings.add_once(origin.of("name"),
                      fmt::format("name '{}' is not made of lower-case words and numbers joined by "
                                  "'-' or '.'",
                                  name));
  };
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    check(parameter.name, origin);
  });
  for_each_action(draft,
                  [&](const Action& action, const Origin& origin) { check(action.name, origin); });
}

void names_are_no_numbers(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.numbered) return;
  const std::string_view prefix = draft.profile.numbered->prefix;
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const std::string_view name = parameter.name;
    if (!name.starts_with(prefix) || name.size() == prefix.size()) return;
    if (name.find_first_not_of("0123456789", prefix.size()) != std::string_view::npos) return;
    findings.add_once(origin.of("name"),
                      fmt::format("name '{}' looks like a numbered parameter", name));
  });
}

// ---- registers ----

void registers_are_in_the_table(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (span_of(parameter, 0).last <= last_register) return;
    findings.add_once(origin.of("register"),
                      fmt::format("{}: its second register is behind the last", parameter.name));
  });
}

void overlaps_are_declared(const ProfileDraft& draft, Diagnostics& findings) {
  std::vector<Span> spans;
  spans.reserve(draft.parameters.size());
  for (std::size_t i = 0; i < draft.parameters.size(); ++i) {
    spans.push_back(span_of(draft.profile.parameters[i], i));
  }
  std::stable_sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) {
    return std::tie(a.table, a.first) < std::tie(b.table, b.first);
  });
  std::size_t reaching = 0;  // the span seen so far that reaches farthest
  for (std::size_t i = 1; i < spans.size(); ++i) {
    const Span& span = spans[i];
    const Span& before = spans[reaching];
    const bool overlap = catalogue::share_bits(draft.profile.parameters[span.index],
                                               draft.profile.parameters[before.index]);
    const bool declared =
        draft.parameters[span.index].overlaps || draft.parameters[before.index].overlaps;
    if (overlap && !declared) {
      const auto [earlier, later] = std::minmax(span.index, before.index);
      findings.add_once(
          draft.parameters[later].of("register"),
          fmt::format("{} shares register {} with {}; write 'overlaps: true' if this is meant",
                      draft.profile.parameters[later].name, span.first,
                      draft.profile.parameters[earlier].name));
    }
    if (span.table != before.table || span.last >= before.last) reaching = i;
  }
}

void pairs_are_even(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.link.even_pairs) return;
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const bool pair = catalogue::register_count(parameter.encoding) == 2 &&
                      parameter.encoding.kind != catalogue::Kind::text;
    if (!pair || parameter.address.value % 2 == 0) return;
    findings.add_once(origin.of("register"),
                      fmt::format("{}: a 32-bit value begins at an odd register, {}",
                                  parameter.name, parameter.address.value));
  });
}

void input_registers_are_read_only(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (modbus::is_writable(parameter.table) || parameter.access == Access::read_only) return;
    findings.add_once(origin.of("access"),
                      fmt::format("{}: {} cannot be written", parameter.name,
                                  parameter.table == RegisterTable::input ? "input registers"
                                                                          : "discrete inputs"));
  });
}

// ---- encodings ----

/// The first thing that is wrong with an encoding; empty when it is good.
std::string fault_of(const Parameter& parameter) {
  using catalogue::Kind;
  const catalogue::Encoding& encoding = parameter.encoding;
  constexpr std::uint16_t longest_bcd = 8;
  const bool is_bit_table = modbus::holds_bits(parameter.table);
  if (is_bit_table && encoding.kind != Kind::bit) return "a coil is a 'bit'";
  if (is_bit_table && encoding.is_part()) return "a coil has no bits of its own";
  if (encoding.kind == Kind::bit && !is_bit_table && !encoding.is_part()) {
    return "key 'bit' is missing, which says the bit of the register";
  }
  if (encoding.kind == Kind::text && encoding.length == 0) {
    return "key 'length' is missing, which says how many bytes the text has";
  }
  if (encoding.packing == catalogue::Packing::low && encoding.kind != Kind::text) {
    return "only a text is packed";
  }
  if (encoding.length > 0 && encoding.kind != Kind::text && encoding.kind != Kind::bcd) {
    return "only a text and BCD digits have a length";
  }
  if (encoding.kind == Kind::bcd && encoding.length > longest_bcd) {
    return "more than 16 BCD digits";
  }
  const unsigned room = encoding.kind == Kind::bit ? 16 : 16U * catalogue::register_count(encoding);
  if (unsigned{encoding.slice.first} + encoding.slice.width > room) {
    return "its bits are behind the last one of its registers";
  }
  if (encoding.is_part() && (!encoding.is_integer() || encoding.kind == Kind::bcd)) {
    return "only whole numbers are made of some bits";
  }
  if (encoding.count == 0) return "count must be above zero";
  if (catalogue::register_count(encoding) > modbus::max_read_count) {
    return "it is longer than one request can read";
  }
  if (encoding.count > 1 && encoding.is_part()) return "bits of a register are no list";
  constexpr int most_decimals = 18;
  if (encoding.decimals.value_or(0) > most_decimals) return "more than 18 decimals";
  const bool scales = encoding.scale != Decimal(1) || encoding.divisor != 1 ||
                      encoding.offset != Decimal(0) || !parameter.scale_by.empty();
  if (scales && !encoding.is_integer() && !encoding.is_float()) return "only numbers have a scale";
  if (!parameter.nulls.empty() && !encoding.is_integer() && !encoding.is_float()) {
    return "only numbers have a 'null'";
  }
  return {};
}

void encodings_are_whole(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (const std::string fault = fault_of(parameter); !fault.empty()) {
      findings.add_once(origin.of("encoding"), fmt::format("{}: {}", parameter.name, fault));
    }
  });
}

/// What is decided by another parameter, and in which order they are written.
void others_are_there(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const std::string scale_by = parameter.scale_by;
    if (scale_by.empty() || draft.incomplete) return;
    const Parameter* power = parameter_named(draft, scale_by);
    if (power == nullptr) {
      findings.add_once(origin.of("scale-from"), no_such_parameter(draft, scale_by));
    } else if (!power->encoding.is_integer() || power->encoding.scale != Decimal(1) ||
               power->encoding.divisor != 1 || power->encoding.count > 1 ||
               !power->scale_by.empty()) {
      findings.add_once(origin.of("scale-from"),
                        fmt::format("{}: {} is no whole number", parameter.name, scale_by));
    }
  });
  const std::vector<Parameter> all(draft.profile.parameters.begin(),
                                   draft.profile.parameters.end());
  const auto circle = catalogue::waiting_in_a_circle(all);
  if (!circle.empty()) {
    findings.add_once(draft.top.entry->at,
                      fmt::format("each of these waits for another one to be written: {}",
                                  fmt::join(circle, ", ")));
  }
}

/// A write elsewhere than it is read hits what stands there.
void writes_hit_no_other(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (!parameter.write_address || origin.overlaps) return;
    const unsigned first = parameter.write_address->value;
    const unsigned last = first + catalogue::register_count(parameter.encoding) - 1U;
    for (std::size_t i = 0; i < draft.parameters.size(); ++i) {
      const Parameter& other = draft.profile.parameters[i];
      const Span span = span_of(other, i);
      const bool hit = span.table == parameter.table && span.first <= last && first <= span.last;
      if (!hit || other.name == parameter.name || draft.parameters[i].overlaps) continue;
      findings.add_once(
          origin.of("write-register"),
          fmt::format("{} is written to a register of {}; write 'overlaps: true' if this is meant",
                      parameter.name, other.name));
    }
  });
}

void unlock_is_known(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.unlock || draft.incomplete) return;
  const auto& [name, value, needed_by] = *draft.profile.unlock;
  const Parameter* lock = parameter_named(draft, name);
  if (lock == nullptr) {
    findings.add_once(draft.unlock.of("parameter"), no_such_parameter(draft, name));
  } else if (lock->access == Access::read_only) {
    findings.add_once(draft.unlock.of("parameter"),
                      fmt::format("{} cannot be written, so it unlocks nothing", name));
  } else if (const auto fits = catalogue::encode(*lock, {Decimal(value)}); !fits) {
    findings.add_once(draft.unlock.of("value"), message_of(fits.error()));
  }
}

// ---- values ----

void ranges_fit(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const auto& [minimum, maximum] = parameter.range;
    if (minimum && maximum && *minimum > *maximum) {
      findings.add_once(origin.of("range"),
                        fmt::format("{}: its minimum is above its maximum", parameter.name));
    }
    for (const auto& limit : {minimum, maximum}) {
      if (!limit) continue;
      const auto registers = catalogue::encode(
          parameter, {*limit}, Registers(catalogue::register_count(parameter.encoding)));
      if (!registers) {
        findings.add_once(origin.of("range"),
                          fmt::format("{}: {}", parameter.name, message_of(registers.error())));
      }
    }
  });
}

void defaults_fit(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (!parameter.default_value) return;
    const auto value =
        catalogue::parse_exact_value(parameter, parameter.default_value->to_string());
    if (value) return;
    findings.add_once(origin.of("default"),
                      fmt::format("{}: {}", parameter.name, message_of(value.error())));
  });
}

void read_only_has_no_default(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (!parameter.default_value || parameter.access == Access::read_write) return;
    findings.add_once(origin.of("default"),
                      fmt::format("{}: what is read-only has no default", parameter.name));
  });
}

void settling_ends(const ProfileDraft& draft, Diagnostics& findings) {
  constexpr Duration longest = std::chrono::seconds(30);
  const auto too_long = [&](const Duration& settle, const std::string& what) {
    return fmt::format("{}'settle' is {}, longer than {}", what, to_text(settle), to_text(longest));
  };
  const Duration common = draft.profile.link.settle;
  if (common > longest) findings.add_once(draft.link.of("settle"), too_long(common, {}));
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (!parameter.settle) return;
    if (parameter.access == Access::read_only) {
      findings.add_once(origin.of("settle"),
                        fmt::format("{}: what is read-only is never written, so 'settle' says "
                                    "nothing",
                                    parameter.name));
    } else if (*parameter.settle > longest) {
      findings.add_once(origin.of("settle"), too_long(*parameter.settle, parameter.name + ": "));
    }
  });
}

void read_only_is_never_cloned(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const bool marked = parameter.cloning == catalogue::Cloning::never;
    if (!marked || parameter.access == Access::read_write) return;
    findings.add_once(origin.of("clone"),
                      fmt::format("{}: what is read-only is never restored, so 'clone' says "
                                  "nothing",
                                  parameter.name));
  });
}

void secrets_are_stored(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const bool marked = parameter.secrecy == catalogue::Secrecy::secret;
    if (!marked || modbus::is_writable(parameter.table)) return;
    findings.add_once(
        origin.of("secret"),
        fmt::format(
            "{}: no backup holds {}, so 'secret' says nothing", parameter.name,
            parameter.table == RegisterTable::input ? "input registers" : "discrete inputs"));
  });
}

/// What is written alone waits for no other value, and no other waits for it.
void guarded_stand_alone(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (parameter.guarding == catalogue::Guarding::none) return;
    if (parameter.access == Access::read_only) {
      findings.add_once(origin.of("guarded"),
                        fmt::format("{}: what is read-only is never written, so 'guarded' says "
                                    "nothing",
                                    parameter.name));
    } else if (!parameter.before.empty() || !parameter.after.empty() ||
               !parameter.scale_by.empty()) {
      findings.add_once(origin.of("guarded"),
                        fmt::format("{}: what is guarded is written alone, so it has no 'before', "
                                    "'after' or 'scale-from'",
                                    parameter.name));
    }
  });
}

void torque_unit_is_known(const ProfileDraft& draft, Diagnostics& findings) {
  const std::string name = draft.profile.torque_unit_from;
  if (name.empty()) return;
  if (draft.lacks(name)) {
    findings.add_once(draft.torque_unit.entry->at, no_such_parameter(draft, name));
  }
  const Parameter* parameter = parameter_named(draft, name);
  if (parameter == nullptr) return;
  if (parameter->labels.empty()) {
    findings.add_once(draft.torque_unit.entry->at,
                      fmt::format("{} has no labels that are units", name));
  }
  for (const Label& label : parameter->labels) {
    if (catalogue::is_torque(label.text)) continue;
    findings.add_once(draft.torque_unit.entry->at,
                      fmt::format("{}: '{}' is no unit of torque that is known", name, label.text));
  }
}

/// The first thing wrong with a list of labels; empty when it is good.
std::string fault_of(const catalogue::List<Label>& labels, const Parameter& parameter) {
  Parameter earlier = parameter;
  std::vector<Label> known;
  for (const Label& label : labels) {
    const catalogue::Encoding& encoding = parameter.encoding;
    if (!encoding.is_integer()) return "only whole numbers have labels";
    if (Decimal(label.number) < catalogue::lowest(encoding) ||
        Decimal(label.number) > catalogue::highest(encoding)) {
      return fmt::format("label {} does not fit {}", label.number,
                         catalogue::to_text(encoding.kind));
    }
    if (label.text.empty()) return fmt::format("the label of {} is empty", label.number);
    for (const Label& other : known) {
      if (other.number == label.number) {
        return fmt::format("number {} has two labels", label.number);
      }
    }
    // A label is what a user types, so two that parse_value() cannot tell apart are one.
    earlier.labels = known;
    if (!known.empty() && catalogue::parse_value(earlier, label.text)) {
      return fmt::format("label '{}' can be read in two ways", label.text);
    }
    known.push_back(label);
  }
  return {};
}

void labels_are_unique(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    if (parameter.labels.empty()) return;
    Parameter plain{.name = {},
                    .title = {},
                    .encoding = {.kind = parameter.encoding.kind,
                                 .length = parameter.encoding.length,
                                 .slice = parameter.encoding.slice},
                    .unit = {},
                    .source = {},
                    .note = {}};
    const std::string fault = fault_of(parameter.labels, plain);
    if (!fault.empty()) {
      findings.add_once(origin.of("labels"), fmt::format("{}: {}", parameter.name, fault));
    }
  });
  for_each_action(draft, [&](const Action& action, const Origin& origin) {
    Parameter plain;
    plain.encoding = action.encoding;
    const std::string fault = fault_of(action.labels, plain);
    if (!fault.empty()) {
      findings.add_once(origin.of("labels"), fmt::format("{}: {}", action.name, fault));
    }
  });
}

void entries_have_a_source(const ProfileDraft& draft, Diagnostics& findings) {
  const auto check = [&](const std::string& name, const std::string& source, const Origin& origin) {
    if (source.empty())
      findings.add_once(origin.of("source"), fmt::format("{} has no source", name));
  };
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    check(parameter.name, parameter.source, origin);
  });
  for_each_action(draft, [&](const Action& action, const Origin& origin) {
    check(action.name, action.source, origin);
  });
}

// ---- actions ----

void actions_stay_off_parameters(const ProfileDraft& draft, Diagnostics& findings) {
  const auto& numbered = draft.profile.numbered;
  for_each_action(draft, [&](const Action& action, const Origin& origin) {
    if (!numbered || numbered->table != RegisterTable::holding) return;
    const unsigned first = action.address.value;
    const unsigned last = first + catalogue::register_count(action.encoding) - 1U;
    const unsigned taken = std::max<unsigned>(first, numbered->from);
    if (taken > last || taken > numbered->to) return;
    findings.add_once(
        origin.of("register"),
        fmt::format("{}: register {} belongs to the numbered parameters", action.name, taken));
  });
}

void confirmations_exist(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_action(draft, [&](const Action& action, const Origin& origin) {
    if (action.confirm.empty()) {
      if (action.confirm_value) {
        findings.add_once(origin.of("confirm-value"),
                          fmt::format("{}: confirm-value needs 'confirm'", action.name));
      }
      return;
    }
    if (draft.lacks(action.confirm)) {
      findings.add_once(origin.of("confirm"), no_such_parameter(draft, action.confirm));
    }
  });
}

void what_actions_tell_exists(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_action(draft, [&](const Action& action, const Origin& origin) {
    if (action.tells.empty()) return;
    for (const std::uint16_t value : {action.minimum, action.maximum}) {
      const std::string name = catalogue::numbered_name(action.tells, value);
      if (parameter_named(draft, name) != nullptr) continue;
      findings.add_once(origin.of("tells"), no_such_parameter(draft, name));
    }
  });
}

void effects_are_of_values(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_action(draft, [&](const Action& action, const Origin& origin) {
    for (const Label& effect : action.effects) {
      const bool given = action.value
                             ? effect.number == *action.value
                             : effect.number >= action.minimum && effect.number <= action.maximum;
      if (given) continue;
      findings.add_once(origin.of("effects"),
                        fmt::format("{}: {} is none of its values", action.name, effect.number));
    }
  });
}

// ---- sections ----

/// What tells answers apart where the transaction id does not.
void check_ignored_ids(const ProfileDraft& draft, Diagnostics& findings) {
  const catalogue::LinkSpec& link = draft.profile.link;
  const auto add = [&](std::string message) {
    findings.add_once(draft.link.of("transaction"), std::move(message));
  };
  if (link.framing == modbus::Framing::rtu) {
    add("transaction is for TCP: on a serial line answers have no transaction id");
  } else if (link.any_unit) {
    add("with any-unit nothing but the transaction id tells whose answer it is");
  } else if (catalogue::sends_unasked(draft.profile)) {
    add("only the transaction id tells an answer from an event that is pushed");
  }
}

void link_is_usable(const ProfileDraft& draft, Diagnostics& findings) {
  if (draft.link.entry == nullptr || !draft.link.sound) return;
  const catalogue::LinkSpec& link = draft.profile.link;
  const auto check = [&](std::string_view key, std::uint16_t value, std::uint16_t most) {
    if (value >= 1 && value <= most) return;
    findings.add_once(draft.link.of(key), fmt::format("{} must be 1 to {}", key, most));
  };
  check("max-read", link.max_read, modbus::max_read_count);
  check("max-write", link.max_write, modbus::max_write_count);
  if (link.any_unit && link.framing == modbus::Framing::rtu) {
    findings.add_once(draft.link.of("any-unit"),
                      "any-unit is for TCP: on a serial line the unit tells whose answer it is");
  }
  if (link.transactions == modbus::TransactionIds::ignored) check_ignored_ids(draft, findings);
  if (!link.units) return;
  // 0 is everybody, and 248 to 255 are reserved on a serial line.
  constexpr unsigned highest_unit = 247;
  if (link.units->first == 0 || link.units->last > highest_unit) {
    findings.add_once(draft.link.of("units"),
                      fmt::format("units must be a range from 1 to {}", highest_unit));
  } else if (!link.units->contains({link.unit})) {
    findings.add_once(draft.link.of("unit"),
                      fmt::format("unit {} is none of the units {} to {}", link.unit,
                                  link.units->first, link.units->last));
  }
}

void identity_slices_fit(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.identity) return;
  const catalogue::IdentitySpec& facts = *draft.profile.identity;
  const auto check = [&](std::string_view key, const catalogue::Slice& slice, unsigned bytes) {
    if (unsigned{slice.offset} + slice.size <= bytes) return;
    findings.add_once(draft.identity.of(key),
                      fmt::format("{} reaches behind byte {} of the answer", key, bytes));
  };
  check("id", facts.id, facts.minimum_bytes);
  check("controller-model", facts.controller_model, facts.minimum_bytes);
  check("tool-model", facts.tool_model, facts.minimum_bytes);
  check("firmware", facts.firmware, facts.minimum_bytes);
  check("serial", facts.serial, facts.minimum_bytes);
  check("long-serial", facts.long_serial, facts.long_serial_bytes);
  check("total", facts.total, facts.total_bytes);
}

/// Without a table of models a tool is known by what its serial number says it is.
void identity_tells_products(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.identity) return;
  const catalogue::IdentitySpec& facts = *draft.profile.identity;
  const bool has_products = !facts.products.empty() && facts.long_serial_bytes != 0;
  const bool has_firmware = facts.firmware_from != 0 || facts.firmware_below != 0;
  if (facts.models.empty() && !(has_products && has_firmware)) {
    findings.add_once(draft.identity.of("models"),
                      "key 'models' is missing; without it a tool is known by 'products' of its "
                      "'long-serial' and by 'firmware-from' or 'firmware-below'");
  }
  if (facts.firmware_below != 0 && facts.firmware_from >= facts.firmware_below) {
    findings.add_once(draft.identity.of("firmware-from"),
                      fmt::format("there is no firmware from {} below {}", facts.firmware_from,
                                  facts.firmware_below));
  }
}

/// What a tool says of itself beside its identity are parameters.
void identity_is_told_by_parameters(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.identity) return;
  const catalogue::IdentitySpec& facts = *draft.profile.identity;
  const auto check = [&](const std::string& name, bool is_text) {
    if (name.empty()) return;
    if (draft.lacks(name)) {
      findings.add_once(draft.identity.of("told-by"), no_such_parameter(draft, name));
    }
    const Parameter* parameter = parameter_named(draft, name);
    if (parameter == nullptr) return;
    const bool fits = is_text ? parameter->encoding.kind == catalogue::Kind::text
                              : parameter->encoding.is_integer();
    if (fits && parameter->reading == catalogue::Reading::harmless) return;
    findings.add_once(draft.identity.of("told-by"),
                      fmt::format("{} is no {}", name, is_text ? "text" : "whole number"));
  };
  check(facts.model_from, true);
  check(facts.serial_from, true);
  for (const catalogue::Text& name : facts.version_from) check(name, false);
}

void unasked_frames_are_answers(const ProfileDraft& draft, Diagnostics& findings) {
  for (const catalogue::UnaskedFrame& frame : draft.profile.link.unasked) {
    constexpr auto holding =
        static_cast<std::uint8_t>(modbus::FunctionCode::read_holding_registers);
    constexpr auto input = static_cast<std::uint8_t>(modbus::FunctionCode::read_input_registers);
    if (frame.function != holding && frame.function != input) {
      findings.add_once(draft.link.of("unasked"),
                        "frames that come unasked look like answers to function 3 or 4");
    } else if (frame.count < 2 || frame.count > modbus::max_read_count) {
      findings.add_once(draft.link.of("unasked"),
                        fmt::format("a frame that comes unasked holds 2 to {} registers",
                                    modbus::max_read_count));
    }
  }
}

/// Whether an event block is the answer to a read of one of the two tables of registers.
bool is_block_read(const catalogue::EventSpec& events) {
  using modbus::FunctionCode;
  return events.function == static_cast<std::uint8_t>(FunctionCode::read_holding_registers) ||
         events.function == static_cast<std::uint8_t>(FunctionCode::read_input_registers);
}

void event_block_is_legal(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  if (!is_block_read(events)) {
    findings.add_once(draft.events.of("function"), "events come as answers to function 3 or 4");
  }
  if (events.count < 1 || events.count > modbus::max_read_count) {
    findings.add_once(draft.events.of("count"),
                      fmt::format("an answer holds 1 to {} registers", modbus::max_read_count));
  } else if (events.first.value_or(0) + events.count - 1U > last_register) {
    findings.add_once(draft.events.of("count"), "the event block reaches behind the last register");
  }
}

/// Each source has keys of its own.
void event_source_is_complete(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  const bool pushes = events.model == catalogue::EventModel::push;
  const bool flags = events.model == catalogue::EventModel::flag;
  const auto add = [&](std::string_view key, std::string message) {
    findings.add_once(draft.events.of(key), std::move(message));
  };
  if (!events.first && events.fields.empty()) {
    add("first", "key 'first' is missing");
  } else if (!events.first && !pushes) {
    add("source", "only an event block that is pushed has no known place");
  }
  if (!flags && events.number.empty()) add("number", "key 'number' is missing");
  if (flags && events.flag.empty()) add("flag", "key 'flag' is missing");
  if (!flags && !events.flag.empty()) add("flag", "a flag needs 'source: flag'");
  if (!pushes && events.arm) add("arm", "only frames that come unasked are armed: 'source: push'");
  if (events.interval && *events.interval <= Duration::zero()) {
    add("interval", "an interval is above zero");
  }
  // There an answer may be proved by reading again, which would find a flag that is cleared.
  const catalogue::LinkSpec& link = draft.profile.link;
  if (flags && link.framing == modbus::Framing::rtu) {
    add("source", "a flag that reading clears cannot be read on a serial line");
  } else if (flags && link.transactions == modbus::TransactionIds::ignored) {
    add("source", "a flag that reading clears cannot be read with 'transaction: ignored'");
  }
  const Parameter* number = parameter_named(draft, events.number);
  if (number != nullptr && number->encoding.kind != catalogue::Kind::u16) {
    add("number", fmt::format("{} counts events, so its encoding is u16", number->name));
  }
}

void event_flag_is_consumed(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events || draft.profile.events->flag.empty()) return;
  const std::string& name = draft.profile.events->flag;
  if (draft.lacks(name)) findings.add_once(draft.events.of("flag"), no_such_parameter(draft, name));
  const Parameter* flag = parameter_named(draft, name);
  if (flag == nullptr || flag->reading == catalogue::Reading::consumes) return;
  findings.add_once(draft.events.of("flag"),
                    fmt::format("{}: a flag is cleared by reading; say so there with "
                                "'reading: consumes'",
                                name));
}

bool share(const Span& span, RegisterTable table, unsigned first, unsigned last) {
  return span.table == table && span.first <= last && first <= span.last;
}

/// What else reads registers that reading clears, in words; empty: nothing.
std::string other_reader(const ProfileDraft& draft, const Span& span) {
  const catalogue::Profile& profile = draft.profile;
  const auto& numbered = profile.numbered;
  if (numbered && share(span, numbered->table, numbered->from, numbered->to)) {
    return "it has a number, too";
  }
  if (const auto& limits = profile.limits) {
    for (const unsigned offset : {limits->minimum_offset, limits->maximum_offset}) {
      if (share(span, RegisterTable::holding, limits->from + offset, limits->to + offset)) {
        return "it stands among the tool's own limits";
      }
    }
  }
  if (const auto& events = profile.events; events && events->first) {
    const unsigned last = *events->first + std::max<unsigned>(events->count, 1) - 1U;
    if (share(span, catalogue::table_of(*events), *events->first, last)) {
      return "it stands in the event block";
    }
  }
  const std::string& name = profile.parameters[span.index].name;
  for (const Action& action : profile.actions) {
    if (action.confirm == name) return fmt::format("action '{}' reads it", action.name);
  }
  if (profile.refusals && profile.refusals->parameter == name) return "refusals read it";
  const auto names_it = [&](const auto& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (names_it(profile.watched)) return "'watch' reads it again and again";
  for (const catalogue::AlarmList& list : profile.alarm_lists) {
    if (names_it(list.parameters)) return "an alarm list reads it";
  }
  for (std::size_t i = 0; i < profile.parameters.size(); ++i) {
    const Span other = span_of(profile.parameters[i], i);
    if (profile.parameters[i].scale_by == name) {
      return fmt::format("the scale of {} stands there", profile.parameters[i].name);
    }
    if (profile.parameters[i].bits_by == name) {
      return fmt::format("the bits of {} depend on it", profile.parameters[i].name);
    }
    if (i != span.index && share(span, other.table, other.first, other.last)) {
      return fmt::format("it shares a register with {}", profile.parameters[i].name);
    }
  }
  return {};
}

void consumed_registers_have_one_reader(const ProfileDraft& draft, Diagnostics& findings) {
  for (std::size_t i = 0; i < draft.parameters.size(); ++i) {
    const Parameter& parameter = draft.profile.parameters[i];
    if (parameter.reading != catalogue::Reading::consumes) continue;
    std::string why = other_reader(draft, span_of(parameter, i));
    if (parameter.access != Access::read_only) why = "it would be read back behind a write";
    if (why.empty()) continue;
    findings.add_once(draft.parameters[i].of("reading"),
                      fmt::format("{}: reading clears it, but {}", parameter.name, why));
  }
}

/// A parameter of an event block whose place is not known; null: there is none.
const Parameter* event_field_named(const catalogue::EventSpec& events, std::string_view name) {
  const auto found = std::find_if(events.fields.begin(), events.fields.end(),
                                  [&](const Parameter& field) { return field.name == name; });
  return found == events.fields.end() ? nullptr : &*found;
}

/// Says of a name that it is no parameter of the event block.
void check_event_name(const ProfileDraft& draft, std::string_view key, const std::string& name,
                      Diagnostics& findings) {
  if (name.empty()) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  const auto add = [&](std::string message) {
    findings.add_once(draft.events.of(key), std::move(message));
  };
  if (!events.first) {
    const Parameter* field = event_field_named(events, name);
    const bool is_unread = draft.incomplete || draft.half_read.contains(name);
    if (field == nullptr && !is_unread) add(fmt::format("'{}' is none of the event fields", name));
    if (field == nullptr) return;
    const Span span = span_of(*field, 0);
    if (span.last >= events.count) add(fmt::format("{} is outside the event block", name));
    return;
  }
  const Parameter* parameter = parameter_named(draft, name);
  if (draft.lacks(name)) add(no_such_parameter(draft, name));
  if (parameter == nullptr || !is_block_read(events)) return;
  const Span span = span_of(*parameter, 0);
  const unsigned end = unsigned{*events.first} + events.count;
  if (span.table == catalogue::table_of(events) && span.first >= *events.first && span.last < end) {
    return;
  }
  add(fmt::format("{} is outside the event block", name));
}

void event_fields_are_in_the_block(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  const auto check = [&](std::string_view key, const std::string& name) {
    check_event_name(draft, key, name, findings);
  };
  check("number", events.number);
  check("kind", events.kind);
  check("error", events.error);
  check("preset", events.preset);
  check("torque-unit", events.torque_unit);
  for (const catalogue::Text& name : events.identity) check("told-apart-by", name);
  for (const catalogue::EventColumn& column : events.columns) check("columns", column.parameter);
  if (!events.first) {
    for (const Parameter& field : events.fields) check("count", field.name);
  }
}

void event_frames_are_long_ones(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  for (const catalogue::EventFrame& frame : events.frames) {
    if (!modbus::is_counted_by_words(frame.function)) {
      findings.add_once(draft.events.of("frames"),
                        "functions whose data begin with their own length are 100 to 110");
    }
    if (frame.holds != catalogue::FrameContent::event && !events.curves) {
      findings.add_once(draft.events.of("frames"), "frames with samples need 'curves'");
    }
  }
  if (!events.frames.empty() && events.model != catalogue::EventModel::push) {
    findings.add_once(draft.events.of("frames"),
                      "only a tool that sends events unasked has frames: 'source: push'");
  }
}

void curves_are_in_the_block(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events || !draft.profile.events->curves) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  const catalogue::CurveSpec& curves = *events.curves;
  check_event_name(draft, "curves", curves.sampling, findings);
  for (const catalogue::CurveChannel& channel : curves.channels) {
    check_event_name(draft, "curves", channel.type, findings);
    check_event_name(draft, "curves", channel.count, findings);
  }
  constexpr std::size_t sample_size = 4;
  const std::size_t bytes =
      2 * std::size_t{events.count} + sample_size * curves.most * curves.channels.size();
  constexpr std::size_t head = 10;
  if (bytes + head > modbus::max_long_adu_size) {
    findings.add_once(draft.events.of("curves"),
                      fmt::format("an event with all its samples has {} bytes, a frame at most {}",
                                  bytes, modbus::max_long_adu_size - head));
  }
  if (curves.first_step + 2U * curves.steps > events.count) {
    findings.add_once(draft.events.of("curves"), "the steps are outside the event block");
  }
}

/// What stands behind the usual registers is read-only, and in the form that has it.
void event_forms_are_longer(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events || draft.profile.events->longer.empty()) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  const auto add = [&](std::string message) {
    findings.add_once(draft.events.of("longer"), std::move(message));
  };
  if (!events.first) return add("an event block whose place is not known has one form");
  for (const catalogue::EventForm& form : events.longer) {
    const unsigned end = unsigned{*events.first} + form.count;
    if (form.count <= events.count || form.count > modbus::max_read_count ||
        end > last_register + 1U) {
      add(
          fmt::format("a longer form of the event block holds more than {} registers, and at "
                      "most {}",
                      events.count, modbus::max_read_count));
    }
    bool is_empty = true;
    for (const Parameter& parameter : draft.profile.parameters) {
      if (events.form_of(parameter) != &form) continue;
      is_empty = false;
      const Span span = span_of(parameter, 0);
      const bool is_inside = span.first >= unsigned{*events.first} + events.count &&
                             span.last < end && parameter.access == Access::read_only;
      if (!is_inside) {
        add(fmt::format("{} does not stand in the last {} of {} registers, read-only",
                        parameter.name, form.count - events.count, form.count));
      }
    }
    if (is_empty) add(fmt::format("no parameter of the table is like '{}'", form.parameters));
  }
}

void event_settings_are_parameters(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events) return;
  const catalogue::EventSpec& events = *draft.profile.events;
  if (!events.settings.empty() && events.preset.empty()) {
    findings.add_once(draft.events.of("settings"),
                      "settings belong to a preset: say by `preset` which parameter of the event "
                      "block names it");
  }
  for (const catalogue::EventSetting& setting : events.settings) {
    const std::string name = name_of(setting, 1);
    if (draft.lacks(name))
      findings.add_once(draft.events.of("settings"), no_such_parameter(draft, name));
  }
}

void arming_is_no_parameter(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.events || !draft.profile.events->arm) return;
  const modbus::RegisterAddress address{draft.profile.events->arm->address};
  if (!draft.profile.writable(RegisterTable::holding, address)) return;
  findings.add_once(draft.events.of("arm"),
                    fmt::format("register {} arms events, but is also a parameter", address.value));
}

void alarm_reset_is_an_action(const ProfileDraft& draft, Diagnostics& findings) {
  const std::string& name = draft.profile.alarm_reset;
  if (name.empty() || draft.incomplete) return;
  std::vector<std::string> names;
  for (const Action& action : draft.profile.actions) names.push_back(action.name);
  if (std::find(names.begin(), names.end(), name) != names.end()) return;
  const std::string hint = suggestion(name, names);
  findings.add_once(
      draft.alarm_reset.entry->at,
      fmt::format("'{}' is no action of this profile{}{}", name, hint.empty() ? "" : "; ", hint));
}

void limits_are_in_the_table(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.limits) return;
  const catalogue::LimitSpec& limits = *draft.profile.limits;
  if (limits.from > limits.to) {
    findings.add_once(draft.limits.of("from"), "limits begin behind their end");
  }
  for (const std::string_view key : {"minimum-offset", "maximum-offset"}) {
    const unsigned offset = key == "minimum-offset" ? limits.minimum_offset : limits.maximum_offset;
    if (offset + limits.to > last_register) {
      findings.add_once(draft.limits.of(key), "the limits reach behind the last register");
    }
  }
}

void numbered_are_usable(const ProfileDraft& draft, Diagnostics& findings) {
  if (!draft.profile.numbered) return;
  const catalogue::NumberedSpec& numbered = *draft.profile.numbered;
  const std::string_view prefix = numbered.prefix;
  if (prefix.empty() ||
      prefix.find_first_not_of("abcdefghijklmnopqrstuvwxyz") != std::string::npos) {
    findings.add_once(draft.numbered.of("prefix"), "a prefix is made of lower-case letters");
  }
  if (numbered.from > numbered.to) {
    findings.add_once(draft.numbered.of("from"), "numbers begin behind their end");
  }
  if (numbered.table == RegisterTable::input && numbered.access == Access::read_write) {
    findings.add_once(draft.numbered.of("access"), "input registers cannot be written");
  }
}

void exception_codes_fit(const ProfileDraft& draft, Diagnostics& findings) {
  for (const auto& [code, text] : draft.profile.exceptions) {
    if (code <= std::numeric_limits<std::uint8_t>::max()) continue;
    findings.add_once(draft.top.of("exceptions"),
                      fmt::format("exception code {} does not fit a byte", code));
  }
}

/// Why a parameter that declares no hazard has one.
std::string reason_of(const catalogue::Danger& danger) {
  if (!danger.action.empty()) {
    return fmt::format("it shares a register with action '{}'", danger.action);
  }
  return "it shares a register with a parameter that has a hazard";
}

/// A hazard is one of a write.
void read_only_has_no_hazard(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const bool declared = parameter.hazard != catalogue::Hazard::none;
    if (!declared || parameter.access == Access::read_write) return;
    findings.add_once(origin.of("hazard"),
                      fmt::format("{}: what is read-only has no hazard", parameter.name));
  });
}

using Rule = void (*)(const ProfileDraft&, Diagnostics&);

constexpr std::array<Rule, 45> rules = {
    id_is_the_file_name,
    names_have_the_pattern,
    names_are_no_numbers,
    registers_are_in_the_table,
    overlaps_are_declared,
    writes_hit_no_other,
    pairs_are_even,
    input_registers_are_read_only,
    encodings_are_whole,
    others_are_there,
    unlock_is_known,
    ranges_fit,
    read_only_has_no_default,
    read_only_is_never_cloned,
    settling_ends,
    read_only_has_no_hazard,
    secrets_are_stored,
    guarded_stand_alone,
    torque_unit_is_known,
    defaults_fit,
    labels_are_unique,
    entries_have_a_source,
    actions_stay_off_parameters,
    confirmations_exist,
    what_actions_tell_exists,
    effects_are_of_values,
    link_is_usable,
    identity_slices_fit,
    identity_tells_products,
    identity_is_told_by_parameters,
    unasked_frames_are_answers,
    event_block_is_legal,
    event_source_is_complete,
    event_flag_is_consumed,
    consumed_registers_have_one_reader,
    event_fields_are_in_the_block,
    event_forms_are_longer,
    event_frames_are_long_ones,
    curves_are_in_the_block,
    event_settings_are_parameters,
    arming_is_no_parameter,
    alarm_reset_is_an_action,
    limits_are_in_the_table,
    numbered_are_usable,
    exception_codes_fit,
};

}  // namespace

bool is_catalogue_name(std::string_view text) {
  char before = '.';
  for (const char c : text) {
    const bool joint = c == '.' || c == '-';
    if (!joint && !is_word_character(c)) return false;
    if (joint && !is_word_character(before)) return false;
    before = c;
  }
  return is_word_character(before);
}

void check_guards(const ProfileDraft& draft, Diagnostics& findings) {
  for_each_action(draft, [&](const Action& action, const Origin& origin) {
    if (catalogue::moves_without_end(action)) {
      findings.add_once(
          origin.of("hazard"),
          fmt::format("{}: it moves and has no 'stop', so it is never sent", action.name));
      return;
    }
    const bool moves =
        action.hazard == catalogue::Hazard::moves && action.motion == catalogue::Motion::none;
    const bool is_unread = draft.run.entry != nullptr && !draft.profile.run;
    if (!moves || is_unread || draft.profile.is_guarded_start(action.name)) return;
    findings.add_once(
        origin.of("hazard"),
        fmt::format("{}: it moves, and no 'run' of this profile guards it", action.name));
  });
  const catalogue::Dangers dangers(draft.profile);
  for_each_parameter(draft, [&](const Parameter& parameter, const Origin& origin) {
    const bool silent =
        parameter.access == Access::read_write && parameter.hazard == catalogue::Hazard::none;
    const auto danger = silent ? dangers.find(parameter) : std::nullopt;
    if (!danger || danger->runs_motor) return;  // `run` says what its word does
    const std::string_view hazard = catalogue::to_text(danger->hazard);
    findings.add_once(
        origin.of("access"),
        fmt::format("{}: {} ({}), so it is never set or restored; write 'hazard: {}', or "
                    "'access: r'",
                    parameter.name, danger->effect(), reason_of(*danger), hazard));
  });
}

void check_rules(const ProfileDraft& draft, Diagnostics& findings) {
  for (const Rule rule : rules) rule(draft, findings);
  check_drive_rules(draft, findings);
  check_run_rules(draft, findings);
  check_finding_rules(draft, findings);
}

}  // namespace spindle::files
