#include "qdas_export.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <tuple>
#include <utility>

#include "listing.hpp"
#include "records.hpp"
#include "spindle/base/local_time.hpp"
#include "spindle/base/text.hpp"
#include "spindle/files/qdas_file.hpp"

namespace spindle::commands {
namespace {

using files::QdasPart;
using files::QdasUse;
using report::Align;
using store::Column;
using store::PresetSettings;
using store::RowId;
using store::Setting;

const std::array<report::Column, 5> columns = {{{"FILE", "file"},
                                                {"SERIAL", "serial"},
                                                {"PRESET NUMBER", "preset", Align::right},
                                                {"VALUES", "values", Align::right},
                                                {"LEFT OUT", "left_out", Align::right}}};

/// The limit of the manual's example: per cent of the target, in steps of a millionth part.
std::int64_t tolerance_of(std::int64_t target, std::int64_t limit) {
  constexpr std::int64_t whole = 100 * store::torque_scale;
  return (target * limit + whole / 2) / whole;
}

/// Results with the same tool, preset and settings of the preset.
struct Stratum {
  RowId tool = 0;
  std::int64_t preset = 0;
  std::size_t settings = 0;  ///< which of those of the tool's preset; 0: none is known

  friend auto operator<=>(const Stratum&, const Stratum&) = default;
};

class QdasExport {
 public:
  QdasExport(const ResultsOptions& options, StoredRecords& records, Context& context,
             std::vector<PresetSettings> settings)
      : options_(&options),
        records_(&records),
        context_(&context),
        settings_(std::move(settings)) {}

  void add(const store::EventView& row) {
    const Stratum stratum = stratum_of(row);
    Made& made = parts_[stratum];
    made.place = row.place;
    files::QdasRow line;
    line.use = use_of(row);
    line.shown = row.at + context_->clock.utc_offset(row.at);
    const auto& reached = row.columns[Column::torque];
    const auto& angle = row.columns[Column::a3];
    line.values = {reached ? std::optional(in_units(*reached)) : std::nullopt,
                   angle ? std::optional(Decimal(*angle)) : std::nullopt};
    made.has_angle = made.has_angle || angle.has_value();
    if (line.use == QdasUse::left_out) ++made.left_out;
    if (made.part.rows.empty()) made.first = row.at;
    made.part.rows.push_back(std::move(line));
  }

  Result<Outcome> write() {
    TRY(check_paths());
    auto folder = context_->disk.make_folders(options_->qdas, Privacy::usual);
    if (!folder) return tl::unexpected(std::move(folder.error()));
    Listing listing(*context_, columns);
    Outcome outcome;
    std::size_t values = 0;
    for (auto& [stratum, made] : parts_) {
      const std::string path = path_of(stratum, made);
      auto written = context_->disk.write(path, files::render_qdas(made.part), options_->overwrite,
                                          Privacy::usual);
      if (!written) {
        if (written.error().name.empty()) written.error().name = path;
        return tl::unexpected(std::move(written.error()));
      }
      outcome.succeed();
      values += made.part.rows.size();
      listing.add(record_of(stratum, made, path));
    }
    return finish(listing, outcome,
                  {.counts = {{"files", count(parts_.size())}, {"values", count(values)}},
                   .sentence = fmt::format("{}, {}", counted(parts_.size(), "file"),
                                           counted(values, "result"))},
                  *context_);
  }

 private:
  /// All files or none.
  Result<void> check_paths() {
    for (auto& [stratum, made] : parts_) {
      complete(stratum, made);
      Error error{.code = Errc::usage,
                  .message = "this file exists already",
                  .hint = "name another folder, or add --force to replace it"};
      error.name = path_of(stratum, made);
      if (options_->overwrite == Overwrite::allow || !context_->disk.exists(error.name)) continue;
      return tl::unexpected(std::move(error));
    }
    return {};
  }

  struct Made {
    RowId place = 0;
    WallTime first = {};
    bool has_angle = false;
    std::size_t left_out = 0;
    QdasPart part = {};
  };

  /// The newest that were read before the result, else the first ones.
  [[nodiscard]] Stratum stratum_of(const store::EventView& row) const {
    Stratum stratum{.tool = row.tool, .preset = row.columns[Column::preset].value_or(0)};
    std::size_t ordinal = 0;
    for (const PresetSettings& settings : settings_) {
      if (settings.tool != stratum.tool || settings.preset != stratum.preset) continue;
      ++ordinal;
      if (ordinal == 1 || settings.since <= row.at) stratum.settings = ordinal;
    }
    return stratum;
  }

  [[nodiscard]] const PresetSettings* settings_of(const Stratum& stratum) const {
    std::size_t ordinal = 0;
    for (const PresetSettings& settings : settings_) {
      if (settings.tool != stratum.tool || settings.preset != stratum.preset) continue;
      if (++ordinal == stratum.settings) return &settings;
    }
    return nullptr;
  }

  /// A rundown that did not come to its end is no measurement.
  QdasUse use_of(const store::EventView& row) {
    if (row.kind == "fastening-ok") return QdasUse::evaluated;
    const store::Place* place = records_->place(row.place);
    const KnownProfile* known = place == nullptr ? nullptr : records_->known(*place);
    const auto& error = row.columns[Column::error];
    if (known == nullptr || !error) return QdasUse::left_out;
    const catalogue::CodeText* code = known->tables.error.find(*error);
    const bool is_completed = code != nullptr && code->completed == catalogue::Completion::yes;
    return is_completed ? QdasUse::evaluated : QdasUse::left_out;
  }

  void complete(const Stratum& stratum, Made& made) {
    const store::Place* place = records_->place(made.place);
    const PresetSettings* settings = settings_of(stratum);
    made.part.number = place == nullptr ? serial_of(stratum) : place->name;
    made.part.name = fmt::format("preset {}", stratum.preset);
    const std::string first = to_local_text(made.first, context_->clock);
    made.part.remark = fmt::format(
        "serial number {}; torque and angle as the tool itself reports them; times in "
        "the zone of the collecting computer, at first {}",
        serial_of(stratum), first.substr(first.size() - 6));
    made.part.characteristics = {torque_characteristic(torque_unit_of(place), settings)};
    if (made.has_angle) {
      made.part.characteristics.push_back(angle_characteristic(settings));
    } else {
      for (files::QdasRow& row : made.part.rows) row.values.resize(1);
    }
  }

  /// Of the profile, or where it is set on the tool, of the tools file then.
  [[nodiscard]] std::string torque_unit_of(const store::Place* place) const {
    if (place == nullptr) return {};
    const KnownProfile* known = records_->known(*place);
    if (known == nullptr) return place->torque_unit;
    const catalogue::EventLayout layout(known->profile);
    for (const auto& field : layout.fields()) {
      const auto& unit = field.parameter->unit;
      if (field.key == "torque" && unit != catalogue::torque_unit) return unit.to_string();
    }
    return place->torque_unit;
  }

  static files::QdasCharacteristic torque_characteristic(std::string unit,
                                                         const PresetSettings* settings) {
    files::QdasCharacteristic characteristic{.name = "torque", .unit = std::move(unit)};
    if (settings == nullptr) return characteristic;
    const auto& target = (*settings)[Setting::target_torque];
    const auto& limit = (*settings)[Setting::torque_limit];
    if (!target) return characteristic;
    characteristic.nominal = in_units(*target);
    if (!limit || *limit == 0) return characteristic;
    const std::int64_t tolerance = tolerance_of(*target, *limit);
    characteristic.lower = in_units(*target - tolerance);
    characteristic.upper = in_units(*target + tolerance);
    characteristic.remark =
        fmt::format("limits: the preset's own, taken as target +- {} %, read {}",
                    in_units(*limit).to_string(), report::to_text(settings->since));
    return characteristic;
  }

  static files::QdasCharacteristic angle_characteristic(const PresetSettings* settings) {
    files::QdasCharacteristic characteristic{.name = "angle a3", .unit = "\xc2\xb0"};
    if (settings == nullptr) return characteristic;
    const auto known = [](const std::optional<std::int64_t>& angle) {
      return angle && *angle != 0 ? std::optional(Decimal(*angle)) : std::nullopt;
    };
    characteristic.nominal = known((*settings)[Setting::target_angle]);
    characteristic.lower = known((*settings)[Setting::min_angle]);
    characteristic.upper = known((*settings)[Setting::max_angle]);
    return characteristic;
  }

  [[nodiscard]] std::string serial_of(const Stratum& stratum) const {
    const store::Tool* tool = records_->tool(stratum.tool);
    return tool == nullptr ? std::string() : tool->name.serial;
  }

  /// Names come from outside: of a URL only what any file system takes.
  [[nodiscard]] std::string path_of(const Stratum& stratum, const Made& made) const {
    std::string name =
        fmt::format("{}-{}-preset{}", made.part.number, serial_of(stratum), stratum.preset);
    if (stratum.settings > 1) name += fmt::format("-{}", stratum.settings);
    std::replace_if(
        name.begin(), name.end(),
        [](char c) {
          const bool is_letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
          return !is_letter && !(c >= '0' && c <= '9') && c != '-' && c != '.' && c != '@';
        },
        '_');
    if (name.starts_with('.')) name.front() = '_';
    return fmt::format("{}/{}.dfq", options_->qdas, name);
  }

  [[nodiscard]] report::Record record_of(const Stratum& stratum, const Made& made,
                                         const std::string& path) const {
    return {.type = "qdas",
            .target = made.part.number,
            .time = context_->clock.wall(),
            .fields = {{"file", path},
                       {"serial", text_or_null(serial_of(stratum))},
                       {"preset", number(stratum.preset)},
                       {"values", count(made.part.rows.size())},
                       {"left_out", count(made.left_out)}}};
  }

  const ResultsOptions* options_;
  StoredRecords* records_;
  Context* context_;
  std::vector<PresetSettings> settings_;
  std::map<Stratum, Made> parts_ = {};
};

}  // namespace

Result<Outcome> export_qdas(const ResultsOptions& options, store::Reader& reader,
                            StoredRecords& records, const Selection& selection, Context& context) {
  TRY_LET(auto settings, reader.settings());
  store::Filter filter = selection.filter;
  if (filter.kinds.empty()) filter.kinds = {"fastening-ok", "fastening-ng"};
  filter.newest = options.count;
  QdasExport files(options, records, context, std::move(settings));
  auto read = reader.events(filter, [&](const store::EventView& row) {
    if (row.kind.starts_with("fastening-")) files.add(row);
    return !context.interrupt.signalled();
  });
  if (!read) return tl::unexpected(std::move(read.error()));
  if (context.interrupt.signalled()) return tl::unexpected(context.interrupt.error());
  return files.write();
}

}  // namespace spindle::commands
