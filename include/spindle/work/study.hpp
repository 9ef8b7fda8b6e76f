#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spindle/base/decimal.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/files/tools_file.hpp"
#include "spindle/store/rows.hpp"

/// Results of a store, sorted into what may be judged together. Says nothing of statistics.
namespace spindle::work {

/// What of a result is a measurement.
enum class Quantity : std::uint8_t { torque, angle };
inline constexpr auto quantity_words =
    enum_table<Quantity>({{"torque", Quantity::torque}, {"angle", Quantity::angle}});
inline constexpr std::array quantities = {Quantity::torque, Quantity::angle};

/// A fact of each quantity.
template <typename T>
class PerQuantity {
 public:
  [[nodiscard]] const T& operator[](Quantity quantity) const {
    return values_[static_cast<std::size_t>(quantity)];
  }
  T& operator[](Quantity quantity) { return values_[static_cast<std::size_t>(quantity)]; }

 private:
  std::array<T, 2> values_ = {};
};

/// What a product says of its results.
struct ProductFacts {
  bool is_known = false;             ///< there is a profile
  catalogue::CodeTexts errors = {};  ///< that decide which NG results are measurements
  std::optional<std::int64_t> loosening = std::nullopt;  ///< direction of what is no fastening
  PerQuantity<Decimal> steps = usual_steps();            ///< of the tool's own resolution

  static PerQuantity<Decimal> usual_steps();
};
ProductFacts facts_of(const catalogue::Profile& profile, catalogue::CodeTexts errors);

/// How a fastening counts.
enum class Completeness : std::uint8_t {
  ok,
  ng,             ///< it came to its end outside of its limits: a measurement
  not_completed,  ///< it did not come to its end: no measurement of the same thing
  unclear,        ///< NG, and its code is not known to mean either
};

/// One fastening. Torque in ten-thousandths of the tool's unit, angle in degrees.
struct StudiedResult {
  store::RowId id = 0;
  WallTime at = {};
  PerQuantity<std::optional<std::int64_t>> values = {};
  /// Between results of two stretches something is missing, or the tool began to count anew.
  std::uint32_t stretch = 0;
  Completeness completeness = Completeness::ok;
  bool is_excluded = false;
};

enum class LimitsOrigin : std::uint8_t {
  none,   ///< there are no limits
  tool,   ///< those by which the tool itself judges
  file,   ///< those of the joint, by the tools file
  given,  ///< those of the joint, by the user
};

struct QuantityLimits {
  std::optional<Decimal> lower = std::nullopt;  ///< in the tool's unit, or degrees
  std::optional<Decimal> upper = std::nullopt;
  LimitsOrigin origin = LimitsOrigin::none;
  std::string why_none = {};  ///< why the tool's own are not known, where something is known

  [[nodiscard]] bool is_any() const { return lower || upper; }
};

/// What results have in common that may be judged together.
struct StratumFacts {
  std::optional<std::int64_t> preset = std::nullopt;
  std::optional<std::int64_t> target = std::nullopt;  ///< torque in ten-thousandths
  /// Of the preset, as they were read; `since` says when. Empty: not known.
  std::optional<store::PresetSettings> settings = std::nullopt;
  std::optional<std::uint32_t> firmware = std::nullopt;
  std::string torque_unit = {};
};

/// NG results of one code.
struct CodeCount {
  std::size_t count = 0;
  Completeness completeness = Completeness::unclear;
};

/// Results of one tool and preset between two changes of its settings, in their order.
struct Stratum {
  store::RowId tool = 0;
  store::RowId place = 0;  ///< the last one
  StratumFacts facts = {};
  PerQuantity<QuantityLimits> limits = {};
  PerQuantity<Decimal> steps = {};  ///< resolution
  std::string change = {};          ///< what began it: "target 2.71 -> 2.80"; empty: the first
  std::vector<StudiedResult> results = {};
  std::size_t ok = 0;
  std::size_t ng = 0;  ///< all that are not OK
  std::size_t not_completed = 0;
  std::size_t unclear = 0;
  std::size_t excluded = 0;
  std::size_t of_unknown_age = 0;                ///< their times are "not later than"
  std::map<std::int64_t, CodeCount> codes = {};  ///< of NG results; 0: without a code
};

/// What of one tool is no fastening, or is missing.
struct StudiedTool {
  store::RowId tool = 0;
  std::map<std::string, std::size_t> others = {};  ///< events that are no results, by their kinds
  std::size_t loosenings = 0;
  std::vector<store::Gap> gaps = {};
  std::uint64_t missed = 0;  ///< that are known to be
  bool is_at_least = false;  ///< there may be more
};

/// A result that the user takes out of the statistics. It stays in yield and Pareto.
struct Exclusion {
  std::string serial;
  std::int64_t epoch = 0;
  std::uint16_t number = 0;
  std::string reason;
  std::string value = {};  ///< torque and angle, once it was found
  bool is_found = false;
};

/// A preset of a target, by its name.
using Joint = std::pair<std::string, std::int64_t>;

struct StudyOptions {
  Duration shift_break = std::chrono::minutes(30);  ///< a longer pause ends a run of neighbours
  bool include_not_completed = false;
  std::optional<std::int64_t> preset = std::nullopt;
  /// Limits that win over all others.
  PerQuantity<std::optional<files::JointLimits>> limits = {};
  /// Torque limits that win over those of the tools.
  std::map<Joint, files::JointLimits> joints = {};
};

/// What a store says beside its events.
struct StoreFacts {
  std::vector<store::Tool> tools = {};
  std::vector<store::Place> places = {};
  std::vector<store::Epoch> epochs = {};
  std::vector<store::PresetSettings> settings = {};   ///< by tool, preset and time
  std::vector<store::Gap> gaps = {};                  ///< of the tools and the time that are meant
  std::map<std::string, ProductFacts> products = {};  ///< by profile

  [[nodiscard]] const store::Tool& tool(store::RowId id) const;
  [[nodiscard]] const store::Place& place(store::RowId id) const;
  [[nodiscard]] const ProductFacts& product(const store::Place& place) const;
};

/// The values of one quantity in a stratum that are measurements, in their order.
struct StudiedValues {
  std::vector<double> values = {};
  std::vector<std::size_t> breaks = {};     ///< indices that have no neighbour before them
  std::vector<std::size_t> positions = {};  ///< of the values among the results
};
StudiedValues values_of(const Stratum& stratum, Quantity quantity, const StudyOptions& options);

/// Sorts events into strata, as they come.
class Study {
 public:
  /// `facts` must outlive it.
  Study(const StoreFacts& facts, StudyOptions options, std::vector<Exclusion> exclusions = {});
  ~Study();
  Study(const Study&) = delete;
  Study& operator=(const Study&) = delete;

  /// In the order of the store.
  void add(const store::EventView& event);

  [[nodiscard]] const StoreFacts& facts() const { return *facts_; }
  [[nodiscard]] const StudyOptions& options() const { return options_; }
  [[nodiscard]] const std::vector<Exclusion>& exclusions() const { return exclusions_; }
  /// By tool and preset, in order of time; each has a result.
  [[nodiscard]] std::vector<const Stratum*> strata() const;
  /// Of every tool that has an event or a gap.
  [[nodiscard]] std::vector<const StudiedTool*> tools() const;
  [[nodiscard]] const StudiedTool& tool(store::RowId id) const;

 private:
  class ToolCourse;

  const StoreFacts* facts_;
  StudyOptions options_;
  std::vector<Exclusion> exclusions_;
  std::map<store::RowId, std::unique_ptr<ToolCourse>> courses_;
};

/// A value as it stands in a store: "2.7100" of a torque, "6301" of an angle.
Decimal value_of(Quantity quantity, std::int64_t stored);

/// The same number with as many decimals as a step has, or more where it has more.
Decimal with_least_decimals(Decimal value, const Decimal& step);

/// The same number without zeros at its end: "2.7" of "2.7000".
Decimal without_zeros(Decimal value);

}  // namespace spindle::work
