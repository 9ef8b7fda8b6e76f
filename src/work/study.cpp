#include "spindle/work/study.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "spindle/catalogue/event_layout.hpp"

namespace spindle::work {
namespace {

using catalogue::EventKind;
using store::Column;
using store::RowId;
using store::Setting;

constexpr int torque_decimals = 4;
/// The mode in which a preset's torque limit is a share of its target torque.
constexpr std::int64_t torque_control = 0;

constexpr Column column_of(Quantity quantity) {
  return quantity == Quantity::torque ? Column::torque : Column::a3;
}

template <typename T>
const T& by_id(const std::vector<T>& rows, RowId id) {
  static const T none = {};
  const auto found =
      std::find_if(rows.begin(), rows.end(), [&](auto& row) { return row.id == id; });
  return found == rows.end() ? none : *found;
}

/// With the decimals of the product's torque.
std::string shown(const std::optional<Decimal>& value, const Decimal& step) {
  return value ? with_least_decimals(*value, step).to_string() : "not known";
}

std::optional<Decimal> torque_of(const std::optional<std::int64_t>& stored) {
  return stored ? std::optional(value_of(Quantity::torque, *stored)) : std::nullopt;
}

/// Target torque and how many ten-thousandths of a percent are allowed up and down.
QuantityLimits torque_limits(const StratumFacts& facts) {
  QuantityLimits limits;
  if (!facts.settings) {
    limits.why_none = "the settings of the preset were not read";
    return limits;
  }
  const store::PresetSettings& settings = *facts.settings;
  const auto target = settings[Setting::target_torque];
  const auto share = settings[Setting::torque_limit];
  if (!target || !share) {
    limits.why_none = "the tool does not say them";
  } else if (settings[Setting::mode].value_or(torque_control) != torque_control) {
    limits.why_none = "what a torque limit means in this mode of the preset is not known";
  } else if (*share == 0) {
    limits.why_none = "the preset's torque limit is 0";
  } else {
    const auto times = [&](std::int64_t part) {
      return Decimal(*target, -torque_decimals).times(Decimal(part, -6));
    };
    constexpr std::int64_t whole = 1'000'000;
    limits.lower = times(whole - *share);
    limits.upper = times(whole + *share);
    limits.origin = LimitsOrigin::tool;
  }
  return limits;
}

/// An angle of 0 is where a limit is not used.
QuantityLimits angle_limits(const StratumFacts& facts) {
  QuantityLimits limits;
  if (!facts.settings) {
    limits.why_none = "the settings of the preset were not read";
    return limits;
  }
  const auto used = [&](Setting setting) -> std::optional<Decimal> {
    const auto value = (*facts.settings)[setting];
    return value && *value > 0 ? std::optional(Decimal(*value)) : std::nullopt;
  };
  limits.lower = used(Setting::min_angle);
  limits.upper = used(Setting::max_angle);
  if (limits.is_any()) {
    limits.origin = LimitsOrigin::tool;
  } else {
    limits.why_none = "the preset has none";
  }
  return limits;
}

PerQuantity<QuantityLimits> limits_of(const StratumFacts& facts, const std::string& target,
                                      const StudyOptions& options) {
  PerQuantity<QuantityLimits> limits;
  for (const Quantity quantity : quantities) {
    limits[quantity] = quantity == Quantity::torque ? torque_limits(facts) : angle_limits(facts);
    const auto joint = options.joints.find({target, facts.preset.value_or(-1)});
    if (quantity == Quantity::torque && joint != options.joints.end()) {
      limits[quantity] = {joint->second.lower, joint->second.upper, LimitsOrigin::file, {}};
    }
    const auto& given = options.limits[quantity];
    if (given) {
      limits[quantity] = {given->lower, given->upper, LimitsOrigin::given, {}};
    }
  }
  return limits;
}

bool has_same_values(const std::optional<store::PresetSettings>& a,
                     const store::PresetSettings* b) {
  return a ? b != nullptr && a->values == b->values : b == nullptr;
}

std::string setting_text(const store::PresetSettings& settings, Setting which) {
  const auto& value = settings[which];
  if (!value) return "not known";
  if (which != Setting::torque_limit) return std::to_string(*value);
  return without_zeros(Decimal(*value, -torque_decimals)).to_string() + " %";
}

/// What is different between two strata of one preset, in words.
std::string change_between(const StratumFacts& a, const StratumFacts& b, const Decimal& step) {
  std::string text;
  const auto add = [&](std::string_view what, const std::string& before,
                       const std::string& behind) {
    if (before == behind) return;
    text += fmt::format("{}{} {} \u2192 {}", text.empty() ? "" : ", ", what, before, behind);
  };
  add("target", shown(torque_of(a.target), step), shown(torque_of(b.target), step));
  const auto add_setting = [&](std::string_view what, Setting which) {
    add(what, setting_text(*a.settings, which), setting_text(*b.settings, which));
  };
  if (a.settings && b.settings) {
    add_setting("torque limit", Setting::torque_limit);
    add_setting("mode", Setting::mode);
    add_setting("target angle", Setting::target_angle);
    add_setting("smallest angle", Setting::min_angle);
    add_setting("largest angle", Setting::max_angle);
  } else if (a.settings.has_value() != b.settings.has_value() && text.empty()) {
    text = b.settings ? "settings were read" : "settings not known";
  }
  const auto firmware = [](const StratumFacts& facts) {
    return facts.firmware ? std::to_string(*facts.firmware) : "not known";
  };
  add("firmware", firmware(a), firmware(b));
  add("torque unit", a.torque_unit.empty() ? "not known" : a.torque_unit,
      b.torque_unit.empty() ? "not known" : b.torque_unit);
  return text;
}

Completeness completeness_of(std::int64_t code, const ProductFacts& product) {
  const auto found = std::find_if(product.errors.begin(), product.errors.end(),
                                  [&](const auto& entry) { return entry.key == code; });
  if (found == product.errors.end()) return Completeness::unclear;
  switch (found->value.completed) {
    case catalogue::Completion::yes:
      return Completeness::ng;
    case catalogue::Completion::no:
      return Completeness::not_completed;
    case catalogue::Completion::unknown:
      break;
  }
  return Completeness::unclear;
}

/// The target torque that an event was made with; a tool that says 0 does not say it.
std::optional<std::int64_t> target_of(const store::EventView& event) {
  const auto& target = event.columns[Column::target_torque];
  return target.value_or(0) > 0 ? target : std::nullopt;
}

bool is_measurement(const StudiedResult& result, const StudyOptions& options) {
  if (result.is_excluded) return false;
  if (result.completeness == Completeness::not_completed) return options.include_not_completed;
  return result.completeness != Completeness::unclear;
}

}  // namespace

PerQuantity<Decimal> ProductFacts::usual_steps() {
  PerQuantity<Decimal> steps;
  steps[Quantity::torque] = Decimal(1, -2);
  steps[Quantity::angle] = Decimal(1);
  return steps;
}

ProductFacts facts_of(const catalogue::Profile& profile, catalogue::CodeTexts errors) {
  ProductFacts facts{.is_known = true, .errors = std::move(errors)};
  if (!profile.events) return facts;
  const catalogue::EventLayout layout(profile);
  for (const auto& field : layout.fields()) {
    const catalogue::Encoding& encoding = field.parameter->encoding;
    for (const Quantity quantity : quantities) {
      const bool is_meant = field.key == store::column_words.text(column_of(quantity));
      // A floating-point number has the steps that the store keeps.
      if (is_meant && encoding.is_float() && quantity == Quantity::torque) {
        facts.steps[quantity] = Decimal(1, -torque_decimals);
      }
      if (!is_meant || !encoding.is_integer() || encoding.divisor != 1) continue;
      facts.steps[quantity] = encoding.scale;
    }
    if (field.key != store::column_words.text(Column::direction)) continue;
    for (const auto& label : field.parameter->labels) {
      if (label.text == "loosening") facts.loosening = label.number;
    }
  }
  return facts;
}

const store::Tool& StoreFacts::tool(RowId id) const { return by_id(tools, id); }
const store::Place& StoreFacts::place(RowId id) const { return by_id(places, id); }

const ProductFacts& StoreFacts::product(const store::Place& place) const {
  static const ProductFacts none = {};
  const auto found = products.find(place.profile);
  return found == products.end() ? none : found->second;
}

Decimal without_zeros(Decimal value) {
  const std::string text = value.to_string();
  const auto point = text.find('.');
  if (point == std::string::npos) return value;
  const auto last = text.find_last_not_of('0');
  return value.with_decimals(static_cast<int>(last > point ? last - point : 0));
}

Decimal with_least_decimals(Decimal value, const Decimal& step) {
  const Decimal bare = without_zeros(value);
  return bare.exponent() > step.exponent() ? bare.with_decimals(-step.exponent()) : bare;
}

Decimal value_of(Quantity quantity, std::int64_t stored) {
  return {stored, quantity == Quantity::torque ? -torque_decimals : 0};
}

StudiedValues values_of(const Stratum& stratum, Quantity quantity, const StudyOptions& options) {
  StudiedValues found;
  const double scale = quantity == Quantity::torque ? double{store::torque_scale} : 1.0;
  const StudiedResult* before = nullptr;
  for (std::size_t at = 0; at < stratum.results.size(); ++at) {
    const StudiedResult& result = stratum.results[at];
    const auto& value = result.values[quantity];
    if (!value || !is_measurement(result, options)) continue;
    const bool is_interrupted = before != nullptr && (before->stretch != result.stretch ||
                                                      result.at - before->at > options.shift_break);
    if (is_interrupted) found.breaks.push_back(found.values.size());
    found.values.push_back(static_cast<double>(*value) / scale);
    found.positions.push_back(at);
    before = &result;
  }
  return found;
}

/// One tool, from its first event to its last.
class Study::ToolCourse {
 public:
  ToolCourse(RowId tool, Study& study) : study_(&study) {
    facts.tool = tool;
    for (const store::Gap& gap : study.facts_->gaps) {
      if (gap.tool != tool) continue;
      facts.gaps.push_back(gap);
      facts.missed += gap.missed.value_or(0);
      facts.is_at_least = facts.is_at_least || gap.at_least || !gap.missed;
      (gap.before ? numbered_ : open_).push_back(&gap);
    }
    std::sort(numbered_.begin(), numbered_.end(), [](const auto* a, const auto* b) {
      return std::tie(a->epoch, *a->before) < std::tie(b->epoch, *b->before);
    });
    std::sort(open_.begin(), open_.end(),
              [](const auto* a, const auto* b) { return a->began < b->began; });
  }

  void add(const store::EventView& event) {
    note_interruptions(event);
    const auto kind = catalogue::event_kind_words.find(event.kind);
    if (kind != EventKind::fastening_ok && kind != EventKind::fastening_ng) {
      ++facts.others[std::string(event.kind)];
      return;
    }
    const store::Place& place = place_of(event.place);
    const ProductFacts& product = study_->facts_->product(place);
    const auto& direction = event.columns[Column::direction];
    if (product.loosening && direction == product.loosening) {
      ++facts.loosenings;
      return;
    }
    const auto& preset = event.columns[Column::preset];
    if (study_->options_.preset && preset != study_->options_.preset) return;
    Stratum& stratum = stratum_of(event, place, product);
    StudiedResult result{.id = event.id, .at = event.at, .stretch = stretch_};
    for (const Quantity quantity : quantities) {
      result.values[quantity] = event.columns[column_of(quantity)];
    }
    count(event, kind == EventKind::fastening_ok, product, result, stratum);
    stratum.results.push_back(result);
  }

  StudiedTool facts = {};
  std::map<std::optional<std::int64_t>, std::vector<std::unique_ptr<Stratum>>> strata = {};

 private:
  void note_interruptions(const store::EventView& event) {
    const auto place = std::tuple(event.epoch, event.number);
    while (next_numbered_ < numbered_.size() &&
           std::tuple(numbered_[next_numbered_]->epoch, *numbered_[next_numbered_]->before) <=
               place) {
      ++next_numbered_;
      ++stretch_;
    }
    while (next_open_ < open_.size() && open_[next_open_]->began <= event.at) {
      ++next_open_;
      ++stretch_;
    }
    if (epoch_ && *epoch_ != event.epoch && !only_wrapped(event.epoch)) ++stretch_;
    epoch_ = event.epoch;
  }

  /// Whether the tool counted on into this epoch.
  [[nodiscard]] bool only_wrapped(std::int64_t epoch) const {
    const auto& epochs = study_->facts_->epochs;
    return std::any_of(epochs.begin(), epochs.end(), [&](const store::Epoch& each) {
      return each.tool == facts.tool && each.ordinal == epoch &&
             each.reason == store::EpochReason::wrap;
    });
  }

  const store::Place& place_of(RowId id) {
    if (place_ == nullptr || place_->id != id) place_ = &study_->facts_->place(id);
    return *place_;
  }

  /// The settings that an event was made with: those in force at its time, or where its target says
  /// that they were read too late, the next ones.
  const store::PresetSettings* settings_of(const store::EventView& event) {
    const auto& preset = event.columns[Column::preset];
    if (!preset) return nullptr;
    const auto target = target_of(event);
    const auto& all = settings_of(*preset);
    const auto fits = [&](const store::PresetSettings* row) {
      const auto& own = (*row)[Setting::target_torque];
      return !target || !own || *target == *own;
    };
    const auto next = std::upper_bound(
        all.begin(), all.end(), event.at,
        [](WallTime at, const store::PresetSettings* row) { return at < row->since; });
    if (next != all.begin() && fits(*(next - 1))) return *(next - 1);
    return next != all.end() && fits(*next) ? *next : nullptr;
  }

  const std::vector<const store::PresetSettings*>& settings_of(std::int64_t preset) {
    const auto [found, is_new] = settings_.try_emplace(preset);
    if (!is_new) return found->second;
    for (const store::PresetSettings& row : study_->facts_->settings) {
      if (row.tool == facts.tool && row.preset == preset) found->second.push_back(&row);
    }
    return found->second;
  }

  Stratum& stratum_of(const store::EventView& event, const store::Place& place,
                      const ProductFacts& product) {
    const store::PresetSettings* settings = settings_of(event);
    auto target = target_of(event);
    if (!target && settings != nullptr) target = (*settings)[Setting::target_torque];
    auto& of_preset = strata[event.columns[Column::preset]];
    if (!of_preset.empty()) {
      Stratum& last = *of_preset.back();
      const bool is_same =
          last.facts.target == target && has_same_values(last.facts.settings, settings) &&
          last.facts.firmware == place.firmware && last.facts.torque_unit == place.torque_unit;
      if (is_same) {
        last.place = place.id;
        return last;
      }
    }
    auto stratum = std::make_unique<Stratum>();
    stratum->tool = event.tool;
    stratum->place = place.id;
    stratum->facts = {.preset = event.columns[Column::preset],
                      .target = target,
                      .settings = settings != nullptr ? std::optional(*settings) : std::nullopt,
                      .firmware = place.firmware,
                      .torque_unit = place.torque_unit};
    stratum->limits = limits_of(stratum->facts, place.name, study_->options_);
    stratum->steps = product.steps;
    if (!of_preset.empty()) {
      stratum->change =
          change_between(of_preset.back()->facts, stratum->facts, product.steps[Quantity::torque]);
    }
    of_preset.push_back(std::move(stratum));
    return *of_preset.back();
  }

  void count(const store::EventView& event, bool is_ok, const ProductFacts& product,
             StudiedResult& result, Stratum& stratum) {
    const bool was_fetched = event.source == "catch-up" && !event.tool_time;
    if (event.remembered || was_fetched) ++stratum.of_unknown_age;
    result.is_excluded = exclude(event);
    if (result.is_excluded) ++stratum.excluded;
    if (is_ok) {
      ++stratum.ok;
      return;
    }
    ++stratum.ng;
    const std::int64_t code = event.columns[Column::error].value_or(0);
    const auto [known, is_new] = stratum.codes.try_emplace(code);
    if (is_new) known->second.completeness = completeness_of(code, product);
    ++known->second.count;
    result.completeness = known->second.completeness;
    if (result.completeness == Completeness::not_completed) ++stratum.not_completed;
    if (result.completeness == Completeness::unclear) ++stratum.unclear;
  }

  /// Whether the user takes this result out.
  bool exclude(const store::EventView& event) {
    for (Exclusion& exclusion : study_->exclusions_) {
      const bool is_meant = exclusion.number == event.number && exclusion.epoch == event.epoch &&
                            exclusion.serial == study_->facts_->tool(event.tool).name.serial;
      if (!is_meant) continue;
      const auto torque = torque_of(event.columns[Column::torque]);
      const auto& angle = event.columns[Column::a3];
      exclusion.is_found = true;
      exclusion.value = fmt::format(
          "torque {}",
          shown(torque, study_->facts_->product(place_of(event.place)).steps[Quantity::torque]));
      if (angle) exclusion.value += fmt::format(", angle {}", *angle);
      return true;
    }
    return false;
  }

  Study* study_;
  std::vector<const store::Gap*> numbered_ = {};  ///< in order of the event that ended each
  std::vector<const store::Gap*> open_ = {};      ///< that no event ended, in order of time
  std::size_t next_numbered_ = 0;
  std::size_t next_open_ = 0;
  std::optional<std::int64_t> epoch_ = std::nullopt;
  std::uint32_t stretch_ = 0;
  const store::Place* place_ = nullptr;
  std::map<std::int64_t, std::vector<const store::PresetSettings*>> settings_ = {};
};

Study::Study(const StoreFacts& facts, StudyOptions options, std::vector<Exclusion> exclusions)
    : facts_(&facts), options_(std::move(options)), exclusions_(std::move(exclusions)) {
  for (const store::Gap& gap : facts.gaps) {
    auto& course = courses_[gap.tool];
    if (!course) course = std::make_unique<ToolCourse>(gap.tool, *this);
  }
}

Study::~Study() = default;

void Study::add(const store::EventView& event) {
  auto& course = courses_[event.tool];
  if (!course) course = std::make_unique<ToolCourse>(event.tool, *this);
  course->add(event);
}

std::vector<const Stratum*> Study::strata() const {
  std::vector<const Stratum*> all;
  for (const auto& [id, course] : courses_) {
    for (const auto& [preset, of_preset] : course->strata) {
      for (const auto& stratum : of_preset) all.push_back(stratum.get());
    }
  }
  return all;
}

std::vector<const StudiedTool*> Study::tools() const {
  std::vector<const StudiedTool*> all;
  for (const auto& [id, course] : courses_) all.push_back(&course->facts);
  return all;
}

const StudiedTool& Study::tool(RowId id) const {
  static const StudiedTool none = {};
  const auto found = courses_.find(id);
  return found == courses_.end() ? none : found->second->facts;
}

}  // namespace spindle::work
