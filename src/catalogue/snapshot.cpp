#include "spindle/catalogue/snapshot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <unordered_map>
#include <utility>

#include "spindle/base/hash.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/danger.hpp"
#include "spindle/catalogue/write_order.hpp"

namespace spindle::catalogue {
namespace {

template <typename Entries>
auto find_named(const Entries& entries, std::string_view name) -> decltype(entries.data()) {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const auto& entry) { return entry.parameter.name == name; });
  return found == entries.end() ? nullptr : &*found;
}

/// Registers that a parameter stands for. Bits of one register may be those of several.
class Claims {
 public:
  /// Whether none of its registers, or of its bits, was taken before; then they are.
  bool take(const Parameter& parameter) {
    const std::uint16_t count = register_count(parameter.encoding);
    for (std::uint16_t i = 0; i < count; ++i) {
      const auto taken = taken_.find(key_of(parameter, i));
      if (taken != taken_.end() && (taken->second & bits_of(parameter, i)) != 0) return false;
    }
    for (std::uint16_t i = 0; i < count; ++i) {
      taken_[key_of(parameter, i)] |= bits_of(parameter, i);
    }
    return true;
  }

 private:
  static std::uint32_t key_of(const Parameter& parameter, std::uint16_t at) {
    constexpr unsigned address_bits = 16;
    return (static_cast<std::uint32_t>(parameter.table) << address_bits) + parameter.address.value +
           at;
  }
  /// Of one of its registers.
  static std::uint16_t bits_of(const Parameter& parameter, std::uint16_t at) {
    const Encoding& encoding = parameter.encoding;
    const auto all = std::numeric_limits<std::uint16_t>::max();
    if (encoding.slice.is_whole()) return all;
    const std::uint64_t own = std::numeric_limits<std::uint64_t>::max() >>
                              (std::numeric_limits<std::uint64_t>::digits - encoding.slice.width);
    Encoding whole = encoding;
    whole.slice = {};
    const std::uint16_t count = register_count(encoding);
    whole.kind = count == 1 ? Kind::u16 : count == 2 ? Kind::u32 : Kind::u64;
    return to_registers(whole, own << encoding.slice.first).at(at);
  }

  std::unordered_map<std::uint32_t, std::uint16_t> taken_ = {};
};

bool is_numbered(const Parameter& parameter, const NumberedSpec& facts) {
  return parameter.table == facts.table && parameter.address.value >= facts.from &&
         parameter.address.value <= facts.to;
}

/// What is set is stored; what is only shown changes by itself.
std::vector<Parameter> numbered_space(const Profile& profile) {
  const NumberedSpec& facts = *profile.numbered;
  Claims claims;
  std::vector<Parameter> space;
  for (const Parameter& parameter : profile.parameters) {
    const bool stored = is_numbered(parameter, facts) || parameter.access == Access::read_write;
    if (stored && claims.take(parameter)) space.push_back(profile.marked(parameter));
  }
  for (unsigned number = facts.from; number <= facts.to; ++number) {
    Parameter parameter = profile.numbered_parameter(static_cast<std::uint16_t>(number));
    if (claims.take(parameter)) space.push_back(std::move(parameter));
  }
  const Dangers dangers(profile);
  std::erase_if(space, [&](const Parameter& one) { return dangers.find(one).has_value(); });
  std::stable_sort(space.begin(), space.end(), [](const Parameter& a, const Parameter& b) {
    return std::pair(a.table, a.address.value) < std::pair(b.table, b.address.value);
  });
  return space;
}

/// Of several texts, each with its end.
class Digest {
 public:
  void add(std::string_view text) {
    state_ = hash_of(std::string_view("\0", 1), hash_of(text, state_));
  }
  [[nodiscard]] std::string to_string() const { return fmt::format("{:016x}", state_); }

 private:
  std::uint64_t state_ = hash_begin;
};

/// What only some encodings have: those that have none of it keep the digest that they always had.
void add(Digest& digest, const Encoding& encoding) {
  const auto& [kind, scale, divisor, offset, decimals, length, count, slice, word_order, byte_order,
               padding, packing, date] = encoding;
  const std::array<std::pair<std::string_view, std::int64_t>, 10> numbers = {
      {{"divisor", std::int64_t{divisor} - 1},
       {"length", length},
       {"count", count - 1},
       {"first", slice.first},
       {"width", slice.width},
       {"words", static_cast<int>(word_order)},
       {"bytes", static_cast<int>(byte_order)},
       {"padding", static_cast<int>(padding)},
       {"packing", static_cast<int>(packing)},
       {"date", static_cast<int>(date)}}};
  for (const auto& [name, number] : numbers) {
    if (number != 0) digest.add(fmt::format("{} {}", name, number));
  }
  if (offset != Decimal(0)) digest.add(offset.to_string());
}

void add(Digest& digest, const Parameter& parameter) {
  digest.add(parameter.name);
  digest.add(to_text(parameter.table));
  digest.add(std::to_string(parameter.address.value));
  digest.add(to_text(parameter.encoding.kind));
  digest.add(parameter.encoding.scale.to_string());
  add(digest, parameter.encoding);
  digest.add(parameter.unit);
  digest.add(to_text(parameter.access));
  for (const Label& label : parameter.labels) {
    digest.add(std::to_string(label.number));
    digest.add(label.text);
  }
}

bool matches_any(const std::vector<std::string>& patterns, const std::string& name) {
  return std::any_of(patterns.begin(), patterns.end(), [&](const std::string& pattern) {
    return pattern == name || glob_match(pattern, name);
  });
}

/// The names by which users mean what is stored: "p2" stands for the name of register 2.
Result<std::vector<std::string>> understand(const std::vector<std::string>& patterns,
                                            const Profile& profile,
                                            const std::vector<Parameter>& stored) {
  std::vector<std::string> understood;
  for (const std::string& pattern : patterns) {
    const bool matches = std::any_of(stored.begin(), stored.end(), [&](const Parameter& parameter) {
      return matches_any({pattern}, parameter.name);
    });
    if (matches) {
      understood.push_back(pattern);
      continue;
    }
    TRY_LET(auto meant, profile.select({pattern}));
    const auto same = std::find_if(stored.begin(), stored.end(), [&](const Parameter& parameter) {
      return parameter.table == meant.front().table && parameter.address == meant.front().address;
    });
    if (meant.size() == 1 && same == stored.end()) {
      if (const auto danger = danger_of(meant.front(), profile)) {
        return tl::unexpected(Error{.code = Errc::usage,
                                    .message = danger->effect() + ", so no backup holds it",
                                    .hint = danger->remedy(),
                                    .name = pattern});
      }
    }
    if (meant.size() != 1 || same == stored.end()) {
      return tl::unexpected(Error{.code = Errc::unknown_name,
                                  .message = "this is no stored parameter, so no backup holds it",
                                  .name = pattern});
    }
    understood.push_back(same->name);
  }
  return understood;
}

/// One of both is there.
Difference difference_between(const SnapshotEntry* a, const SnapshotEntry* b, Units units) {
  Difference difference{.parameter = (a != nullptr ? a : b)->parameter, .units = units};
  if (a != nullptr) difference.a = a->value;
  if (b != nullptr) difference.b = b->value;
  if (a != nullptr) difference.unit_a = a->unit;
  if (b != nullptr) difference.unit_b = b->unit;
  return difference;
}

Sides sides_of(const Snapshot& a, const Snapshot& b) {
  return destination_of(a, b) == Destination::same_tool ? Sides::one_tool : Sides::two_tools;
}

std::string with_unit(const Value& value, const std::string& unit) {
  return unit.empty() ? value.to_string() + " in a unit that is not known"
                      : value.to_string() + " " + unit;
}

/// A number is written only where it means the same on both sides. What is true of one torque is
/// true of all, so one finding stands for them.
class UnitFindings {
 public:
  void add(const SnapshotEntry& wanted, const SnapshotEntry& present) {
    if (count_++ == 0) first_ = other_unit(wanted, present);
  }
  void tell(std::vector<Error>& findings, std::string hint) {
    if (count_ == 0) return;
    first_.hint = std::move(hint);
    if (count_ > 1) first_.message += fmt::format(" (and so on for {} more)", count_ - 1);
    findings.insert(findings.begin(), std::move(first_));
  }

 private:
  static Error other_unit(const SnapshotEntry& wanted, const SnapshotEntry& present) {
    return {.code = Errc::mismatch,
            .message = fmt::format("the backup has {}, and this tool holds {}",
                                   with_unit(wanted.value, wanted.unit),
                                   with_unit(present.value, present.unit)),
            .name = wanted.parameter.name,
            .register_address = wanted.parameter.address.value};
  }

  Error first_ = {};
  std::size_t count_ = 0;
};

/// Whether a side says nothing about a parameter, rather than that it does not exist.
bool says_nothing(const Snapshot& side, const std::string& name, Lacking lacking) {
  if (lacking == Lacking::is_not_compared) return true;
  const MissingEntry* missing = side.find_missing(name);
  return missing != nullptr && missing->why != Missing::absent;
}

Result<void> refuse_beyond(const Parameter& parameter, const Decimal& number, std::string_view side,
                           const Decimal& limit, std::string_view which,
                           modbus::RegisterAddress address) {
  return tl::unexpected(Error{
      .code = Errc::out_of_range,
      .message = fmt::format("{} is {} {}, the {} that the tool itself reports (register {})",
                             number.to_string(), side, limit.to_string(), which, address.value),
      .name = parameter.name,
      .register_address = parameter.address.value});
}

/// Whether the tool's own limits count for a value, or are in a unit that it will not have then.
enum class OwnLimits : std::uint8_t { known, told_later };

/// A value that has to be written must fit the encoding, the profile and the tool.
Result<void> check_write(const SnapshotEntry& wanted, const SnapshotEntry& present,
                         const Profile& profile, OwnLimits own_limits) {
  const Parameter& parameter = wanted.parameter;
  const Decimal& number = wanted.value.number;
  const auto registers = encode(parameter, wanted.value, wanted.raw);
  if (!registers) return tl::unexpected(registers.error());
  TRY(check_pair(parameter.encoding, profile.link));
  TRY(check_range(parameter, wanted.value));
  if (own_limits == OwnLimits::told_later) return {};
  const bool has_limits = profile.limit_registers(parameter).has_value();
  if (has_limits && (!present.minimum || !present.maximum)) {
    return tl::unexpected(Error{.code = Errc::out_of_range,
                                .message = "the tool's own limits could not be read, so it is not "
                                           "written",
                                .hint = "try again; 'spindle get --limits' shows what can be read",
                                .name = parameter.name,
                                .register_address = parameter.address.value});
  }
  if (!wanted.value.is_number()) return {};
  return check_own_limits(parameter, number, present.minimum, present.maximum, profile);
}

/// As the profile says what has to be written before what; what is guarded before all others.
std::vector<PlannedWrite> in_order(std::vector<PlannedWrite> writes) {
  std::vector<Parameter> parameters;
  for (const PlannedWrite& write : writes) {
    parameters.push_back(write.parameter);
    parameters.back().scale_by = write.needs;
  }
  std::vector<PlannedWrite> ordered;
  for (const std::size_t index : write_order(parameters)) {
    ordered.push_back(std::move(writes[index]));
  }
  std::stable_partition(ordered.begin(), ordered.end(), [](const PlannedWrite& write) {
    return write.parameter.guarding == Guarding::alone;
  });
  return ordered;
}

std::optional<Skip> skip_of(const SnapshotEntry& wanted, const SnapshotEntry* present,
                            Destination destination, bool comparable) {
  if (present == nullptr) return Skip::absent;
  if (present->value == wanted.value && comparable) return Skip::equal;
  if (wanted.parameter.access == Access::read_only) return Skip::read_only;
  if (wanted.value.content == Content::none) return Skip::no_value;
  const bool belongs_to_one = wanted.parameter.cloning == Cloning::never;
  if (belongs_to_one && destination == Destination::other_tool) return Skip::not_cloned;
  return std::nullopt;
}

/// A restore while it is planned.
class Planner {
 public:
  Planner(const Snapshot& backup, const Snapshot& present, const Profile& profile,
          const Selection& selection, Destination destination, UnitRule units)
      : backup_(&backup),
        present_(&present),
        profile_(&profile),
        selection_(&selection),
        destination_(destination),
        units_(units) {}

  RestorePlan run() {
    for (const Parameter& parameter : backup_->dangerous) {
      if (selection_->contains(parameter)) plan_.skipped.push_back({parameter, Skip::dangerous});
    }
    for (const Parameter& parameter : stored_parameters(*profile_)) {
      const SnapshotEntry* wanted = backup_->find(parameter.name);
      if (wanted == nullptr || !selection_->contains(parameter)) continue;
      const SnapshotEntry* now = present_->find(parameter.name);
      if (parameter.scale_by.empty() || now == nullptr) {
        take(parameter, *wanted, now, {});
      } else {
        take_scaled(parameter, *wanted, *now);
      }
    }
    unit_findings_.tell(plan_.findings, hint_of_units());
    plan_.writes = in_order(std::move(plan_.writes));
    return std::move(plan_);
  }

 private:
  [[nodiscard]] Sides sides() const {
    return destination_ == Destination::same_tool ? Sides::one_tool : Sides::two_tools;
  }

  /// What may be done about a number of another unit.
  [[nodiscard]] std::string hint_of_units() const {
    const Text& decider = profile_->torque_unit_from;
    if (!decider.empty()) {
      const bool is_there = backup_->find(decider.view()) != nullptr;
      return is_there ? fmt::format("name {}, too: it is restored before the torques", decider)
                      : fmt::format("set {} to the unit of the backup first", decider);
    }
    std::string hint = "'torque-unit' in the tools file says the unit of a tool";
    if (!profile_->has_guarded()) hint += "; --force writes the number as it is";
    return hint;
  }

  /// Whether the plan itself writes the unit in which this is counted, which goes first.
  [[nodiscard]] bool changes_unit_of(const Parameter& parameter) const {
    const Text& decider = profile_->torque_unit_from;
    return !decider.empty() && parameter.unit == torque_unit && changes(decider.view());
  }

  /// The unit when that is written.
  [[nodiscard]] std::string unit_after(const Parameter& parameter, const SnapshotEntry& now) const {
    if (!changes_unit_of(parameter)) return now.unit;
    return backup_->find(profile_->torque_unit_from.view())->value.label;
  }

  void take(const Parameter& parameter, const SnapshotEntry& wanted, const SnapshotEntry* now,
            std::string_view needs) {
    const std::string unit = now == nullptr ? std::string() : unit_after(parameter, *now);
    const bool comparable = units_ == UnitRule::ignored || now == nullptr ||
                            units_of(parameter, wanted.unit, unit, sides()) == Units::same;
    if (const auto skip = skip_of(wanted, now, destination_, comparable)) {
      plan_.skipped.push_back({parameter, *skip});
      return;
    }
    if (!comparable) {
      unit_findings_.add(wanted, *now);
      return;
    }
    const auto limits = changes_unit_of(parameter) ? OwnLimits::told_later : OwnLimits::known;
    if (auto allowed = check_write(wanted, *now, *profile_, limits); !allowed) {
      refuse(parameter, std::move(allowed.error()));
    }
    Parameter written = needs.empty() ? parameter : wanted.parameter;
    plan_.writes.push_back(
        {std::move(written), now->value, wanted.value, unit, std::string(needs)});
  }

  void refuse(const Parameter& parameter, Error finding) {
    finding.name = parameter.name;
    finding.register_address = parameter.address.value;
    plan_.findings.push_back(std::move(finding));
  }

  /// Whether the plan writes what the backup has of this parameter.
  [[nodiscard]] bool changes(std::string_view name) const {
    const SnapshotEntry* wanted = backup_->find(name);
    return wanted != nullptr && selection_->contains(wanted->parameter) &&
           !skip_of(*wanted, present_->find(name), destination_, true);
  }

  /// Whether this parameter is as in the backup when the restore is done.
  [[nodiscard]] bool will_be(std::string_view name) const {
    const SnapshotEntry* wanted = backup_->find(name);
    const SnapshotEntry* now = present_->find(name);
    const bool is_equal = wanted != nullptr && now != nullptr && wanted->value == now->value;
    return is_equal || changes(name);
  }

  /// What a step is worth when the restore is done; empty: it is not known.
  [[nodiscard]] std::optional<Decimal> step_after(const Parameter& parameter,
                                                  const SnapshotEntry& now) const {
    if (!changes(parameter.scale_by)) return now.step;
    const auto power = power_of(backup_->find(parameter.scale_by.view())->value);
    if (!power) return std::nullopt;
    return with_power(parameter, *power).encoding.scale;
  }

  /// A number of steps is written only where a step is worth the same; a quantity is counted anew.
  void take_scaled(const Parameter& parameter, const SnapshotEntry& wanted,
                   const SnapshotEntry& now) {
    const auto step = step_after(parameter, now);
    Parameter counted = wanted.parameter;
    if (step) counted.encoding.scale = *step;
    const bool is_same = wanted.step ? wanted.step == step : will_be(parameter.scale_by);
    if (!is_same && (!wanted.step || !step)) {
      return refuse(parameter, {.code = Errc::mismatch,
                                .message = fmt::format("what its steps are worth is not known, "
                                                       "which {} should say",
                                                       parameter.scale_by)});
    }
    auto then = counted_as(counted, now);
    auto after = is_same ? wanted : counted_anew(counted, wanted);
    then.unit = step == now.step ? now.unit : wanted.unit;
    if (!wanted.step) after.parameter.range = {};  // it is of the quantity, which is not known
    if (after.raw.empty()) {
      return refuse(
          parameter,
          {.code = Errc::mismatch,
           .message = fmt::format("the backup has {} in steps of {}, and this tool counts in steps "
                                  "of {}, as {} says, which cannot hold it",
                                  with_unit(wanted.value, wanted.unit), wanted.step->to_string(),
                                  step->to_string(), parameter.scale_by)});
    }
    take(parameter, after, &then, parameter.scale_by);
  }

  /// What a tool holds, with steps of another worth.
  static SnapshotEntry counted_as(const Parameter& parameter, SnapshotEntry entry) {
    entry.parameter = parameter;
    if (auto value = decode_or_raw(parameter, entry.raw)) entry.value = std::move(*value);
    return entry;
  }

  /// The same quantity in steps of another worth; without registers where they cannot hold it.
  static SnapshotEntry counted_anew(const Parameter& parameter, SnapshotEntry entry) {
    if (entry.value.content == Content::none) return entry;
    Value quantity = entry.value;
    quantity.held = {};
    entry.raw = encode(parameter, quantity).value_or(Registers());
    if (entry.raw.empty()) return entry;
    entry = counted_as(parameter, std::move(entry));
    if (entry.value.number != quantity.number) entry.raw = {};
    return entry;
  }

  const Snapshot* backup_;
  const Snapshot* present_;
  const Profile* profile_;
  const Selection* selection_;
  Destination destination_;
  UnitRule units_;
  UnitFindings unit_findings_ = {};
  RestorePlan plan_ = {};
};

}  // namespace

const SnapshotEntry* Snapshot::find(std::string_view name) const {
  return find_named(entries, name);
}

const MissingEntry* Snapshot::find_missing(std::string_view name) const {
  return find_named(missing, name);
}

std::vector<Parameter> stored_parameters(const Profile& profile) {
  if (profile.numbered) return numbered_space(profile);
  Claims claims;
  const Dangers dangers(profile);
  std::vector<Parameter> stored;
  for (const Parameter& parameter : profile.parameters) {
    const bool is_setting = modbus::is_writable(parameter.table) &&
                            parameter.access == Access::read_write && !dangers.find(parameter);
    if (is_setting && claims.take(parameter)) stored.push_back(profile.marked(parameter));
  }
  return stored;
}

std::string fingerprint(const std::vector<Parameter>& stored) {
  Digest digest;
  for (const Parameter& parameter : stored) add(digest, parameter);
  return digest.to_string();
}

Snapshot snapshot_of_defaults(const Profile& profile) {
  Snapshot snapshot;
  snapshot.target = "defaults";
  snapshot.profile = profile.id;
  for (Parameter& parameter : stored_parameters(profile)) {
    if (!parameter.default_value) continue;
    auto raw = encode(parameter, {*parameter.default_value},
                      Registers(register_count(parameter.encoding)));
    if (!raw) continue;  // the loader of profiles refuses such a default
    auto value = decode_or_raw(parameter, *raw);
    if (!value) continue;
    // How many steps a default is depends on the tool.
    if (!parameter.scale_by.empty()) value->held = {};
    std::string unit = parameter.unit == torque_unit ? std::string() : parameter.unit.to_string();
    snapshot.entries.push_back({.parameter = std::move(parameter),
                                .raw = std::move(*raw),
                                .value = std::move(*value),
                                .unit = std::move(unit)});
  }
  return snapshot;
}

Result<Selection> Selection::make(const std::vector<std::string>& wanted,
                                  const std::vector<std::string>& ignored, const Profile& profile) {
  const std::vector<Parameter> stored = stored_parameters(profile);
  Selection selection;
  TRY_LET(auto named, understand(wanted, profile, stored));
  TRY_LET(auto left_out, understand(ignored, profile, stored));
  selection.wanted_ = std::move(named);
  selection.ignored_ = std::move(left_out);
  return selection;
}

bool Selection::contains(const Parameter& parameter) const {
  const bool wanted = wanted_.empty() || matches_any(wanted_, parameter.name);
  return wanted && !matches_any(ignored_, parameter.name);
}

Units units_of(const Parameter& parameter, std::string_view a, std::string_view b, Sides sides) {
  if (a.empty() && b.empty()) {
    const bool settable = parameter.unit == torque_unit && sides == Sides::two_tools;
    return settable ? Units::unknown : Units::same;
  }
  if (a.empty() || b.empty()) return Units::unknown;
  return a == b ? Units::same : Units::different;
}

Comparison compare(const Snapshot& a, const Snapshot& b, const Selection& selection,
                   Lacking lacking) {
  Comparison comparison;
  const Sides sides = sides_of(a, b);
  for (const SnapshotEntry& entry : a.entries) {
    if (!selection.contains(entry.parameter)) continue;
    const SnapshotEntry* other = b.find(entry.parameter.name);
    if (other == nullptr && says_nothing(b, entry.parameter.name, lacking)) continue;
    const Units units =
        other == nullptr ? Units::same : units_of(entry.parameter, entry.unit, other->unit, sides);
    if (other != nullptr && other->value == entry.value && units == Units::same) {
      ++comparison.same;
      continue;
    }
    comparison.differences.push_back(difference_between(&entry, other, units));
  }
  for (const SnapshotEntry& entry : b.entries) {
    const std::string& name = entry.parameter.name;
    if (!selection.contains(entry.parameter) || a.find(name) != nullptr) continue;
    if (says_nothing(a, name, lacking)) continue;
    comparison.differences.push_back(difference_between(nullptr, &entry, Units::same));
  }
  return comparison;
}

Destination destination_of(const Snapshot& backup, const Snapshot& present) {
  const bool known = backup.identity && present.identity && !backup.identity->serial.empty();
  const bool same = known && backup.identity->serial == present.identity->serial;
  return same ? Destination::same_tool : Destination::other_tool;
}

std::size_t RestorePlan::count(Skip why) const {
  return static_cast<std::size_t>(
      std::count_if(skipped.begin(), skipped.end(),
                    [why](const SkippedEntry& entry) { return entry.why == why; }));
}

RestorePlan plan_restore(const Snapshot& backup, const Snapshot& present, const Profile& profile,
                         const Selection& selection, Destination destination, UnitRule units) {
  return Planner(backup, present, profile, selection, destination, units).run();
}

SnapshotEntry with_step_of(SnapshotEntry entry, const Parameter& parameter,
                           const PlannedWrite& write) {
  if (parameter.scale_by.empty() || write.parameter.name != parameter.scale_by.view()) return entry;
  const auto power = power_of(write.after);
  entry.parameter = with_power(parameter, power.value_or(0));
  entry.step = power ? std::optional(entry.parameter.encoding.scale) : std::nullopt;
  if (!power) entry.unit = {};
  if (power && entry.unit.empty()) entry.unit = parameter.unit;
  if (auto value = decode_or_raw(entry.parameter, entry.raw)) entry.value = std::move(*value);
  return entry;
}

Result<void> check_own_limits(const Parameter& parameter, const Decimal& number,
                              const std::optional<Decimal>& minimum,
                              const std::optional<Decimal>& maximum, const Profile& profile) {
  const auto own = profile.limit_registers(parameter);
  if (!own) return {};
  if (minimum && number < *minimum) {
    return refuse_beyond(parameter, number, "below", *minimum, "minimum", own->minimum);
  }
  if (maximum && number > *maximum) {
    return refuse_beyond(parameter, number, "above", *maximum, "maximum", own->maximum);
  }
  return {};
}

}  // namespace spindle::catalogue
