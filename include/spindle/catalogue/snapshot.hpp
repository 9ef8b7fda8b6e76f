#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/bytes.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/catalogue/value.hpp"

namespace spindle::catalogue {

/// One stored value of a tool, and the tool's own limits where they are known.
struct SnapshotEntry {
  Parameter parameter;
  Registers raw;
  Value value;
  std::string unit = {};  ///< as shown; empty when it has none or it is not known
  std::optional<Decimal> minimum = std::nullopt;
  std::optional<Decimal> maximum = std::nullopt;
  /// What one step was worth, where that stands in another register. Empty: the profile says it, or
  /// it was not known, and the value is counted in steps.
  std::optional<Decimal> step = std::nullopt;
};

/// Why a parameter has no value in a snapshot.
enum class Missing : std::uint8_t {
  absent,      ///< the tool says that there is no such register
  unreadable,  ///< the tool refused to show it
  left_out,    ///< a secret that was not asked for
};

struct MissingEntry {
  Parameter parameter;
  Missing why = Missing::absent;
};

/// What a tool said of itself when the snapshot was taken.
struct SnapshotIdentity {
  std::string model = {};
  std::optional<unsigned> model_code = std::nullopt;
  std::string serial = {};
  std::optional<unsigned> firmware = std::nullopt;
  Bytes raw = {};
  std::string version = {};  ///< of the firmware, "4.0.2"; empty: the product does not say it
};

/// The stored parameters of one tool at one moment: a backup in memory.
struct Snapshot {
  std::string time = {};     ///< "2026-11-22T10:15:30.123Z"
  std::string version = {};  ///< of spindle
  std::string target = {};   ///< as the user named it
  std::string profile = {};
  std::string fingerprint = {};  ///< of the profile
  std::optional<SnapshotIdentity> identity = std::nullopt;
  std::vector<SnapshotEntry> entries = {};  ///< in the order of stored_parameters()
  std::vector<MissingEntry> missing = {};
  /// What an older version took for settings (see danger_of()); without values, never compared.
  std::vector<Parameter> dangerous = {};

  [[nodiscard]] const SnapshotEntry* find(std::string_view name) const;
  [[nodiscard]] const MissingEntry* find_missing(std::string_view name) const;
};

/// Everything that a backup of such a tool holds, each register once. Where parameters are
/// numbered: the whole numbered space by register, under its names where it has some, and named
/// parameters elsewhere that can be written. Otherwise all holding registers that can be set, in
/// the order of the catalogue. Nothing that danger_of() speaks of.
std::vector<Parameter> stored_parameters(const Profile& profile);

/// Tells two versions of a profile apart, as far as backups are concerned: 16 hexadecimal digits of
/// what it says of its stored_parameters(). Does not depend on where the file is.
std::string fingerprint(const std::vector<Parameter>& stored);

/// The profile's defaults as a snapshot; entries without a default are left out.
Snapshot snapshot_of_defaults(const Profile& profile);

/// Names and patterns that narrow what is compared or restored. Empty: everything.
class Selection {
 public:
  Selection() = default;
  /// Error `unknown_name` with a suggestion for a name that is none of the profile's stored
  /// parameters, and for a pattern that matches none.
  static Result<Selection> make(const std::vector<std::string>& wanted,
                                const std::vector<std::string>& ignored, const Profile& profile);

  [[nodiscard]] bool contains(const Parameter& parameter) const;

 private:
  std::vector<std::string> wanted_ = {};
  std::vector<std::string> ignored_ = {};
};

/// How the units of two sides of a parameter go together. Nothing is converted.
enum class Units : std::uint8_t { same, different, unknown };

/// The units of a value of this parameter on two sides, as they are shown. A torque of which no
/// side says the unit is in the same one only within one tool.
enum class Sides : std::uint8_t { one_tool, two_tools };
Units units_of(const Parameter& parameter, std::string_view a, std::string_view b, Sides sides);

/// A parameter whose values differ, or whose units do; an empty side does not have it.
struct Difference {
  Parameter parameter;
  std::optional<Value> a = std::nullopt;
  std::optional<Value> b = std::nullopt;
  std::string unit_a = {};  ///< empty: none, or not known
  std::string unit_b = {};
  Units units = Units::same;
};

/// How many parameters both sides have and agree on, with their units, and those that differ, in
/// the order of `a`; what only `b` has follows. What one side left out or could not read is not
/// compared.
struct Comparison {
  std::vector<Difference> differences = {};
  std::size_t same = 0;
};

/// Whether what one side lacks is a difference. Defaults, for one, are not known for all.
enum class Lacking : std::uint8_t { differs, is_not_compared };

Comparison compare(const Snapshot& a, const Snapshot& b, const Selection& selection,
                   Lacking lacking = Lacking::differs);

/// Whether a restore writes to the tool that the backup came from.
enum class Destination : std::uint8_t { same_tool, other_tool };

/// The same tool only where both serial numbers are known and equal.
Destination destination_of(const Snapshot& backup, const Snapshot& present);

/// Why an entry of the backup is not written.
enum class Skip : std::uint8_t {
  equal,       ///< the tool holds it already
  read_only,   ///< it cannot be written
  not_cloned,  ///< it belongs to one tool (`clone: never`)
  absent,      ///< the tool has no such register
  no_value,    ///< the backup says that there was none
  dangerous,   ///< a write to it may do more than store a value
};

/// Whether a value may be written over one of another or an unknown unit.
enum class UnitRule : std::uint8_t { strict, ignored };

struct PlannedWrite {
  Parameter parameter;
  Value before;
  Value after;
  std::string unit = {};
  /// Parameter that says what its steps are worth, where that is written, too; may be empty. The
  /// value must not be written unless that was.
  std::string needs = {};
};

struct SkippedEntry {
  Parameter parameter;
  Skip why = Skip::equal;
};

/// What a restore will do. With findings nothing must be written.
struct RestorePlan {
  /// In the order of the catalogue, what is guarded before all others.
  std::vector<PlannedWrite> writes = {};
  std::vector<SkippedEntry> skipped = {};
  /// Values outside limits, limits that are not known, and units that do not go together.
  std::vector<Error> findings = {};

  [[nodiscard]] std::size_t count(Skip why) const;
};

/// Compares a backup with what the tool holds, and checks every value that has to be written
/// against encoding, profile and the tool's own limits. Both come from `profile`.
RestorePlan plan_restore(const Snapshot& backup, const Snapshot& present, const Profile& profile,
                         const Selection& selection, Destination destination,
                         UnitRule units = UnitRule::strict);

/// The entry as it is read once `write` is done, where that says what its steps are worth; as it is
/// otherwise. `parameter` is that of the profile.
SnapshotEntry with_step_of(SnapshotEntry entry, const Parameter& parameter,
                           const PlannedWrite& write);

/// `out_of_range` when a value is outside the limits that the tool itself reports; the message
/// names the limit and its register. An absent limit allows everything.
Result<void> check_own_limits(const Parameter& parameter, const Decimal& number,
                              const std::optional<Decimal>& minimum,
                              const std::optional<Decimal>& maximum, const Profile& profile);

}  // namespace spindle::catalogue
