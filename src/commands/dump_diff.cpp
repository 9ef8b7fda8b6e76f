#include "dump_diff.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <variant>

#include "backup_paths.hpp"
#include "comparison.hpp"
#include "diff_side.hpp"
#include "progress.hpp"
#include "raw_need.hpp"
#include "records.hpp"
#include "run_verb.hpp"
#include "spindle/base/text.hpp"
#include "spindle/catalogue/meaning.hpp"
#include "spindle/work/register_survey.hpp"

namespace spindle::commands {
namespace {

using catalogue::Parameter;
using catalogue::Profile;
using report::Align;

const std::array<report::Column, 8> columns = {
    {{"NAME", "name"},
     {"TABLE", "table", Align::left, 0, report::left_out(1)},
     {"REGISTER", "register", Align::right},
     {"A", "a", Align::right},
     {"B", "b", Align::right},
     {"UNIT", "unit"},
     {"RAW A", "raw_a", Align::right, 0, report::left_out(2)},
     {"RAW B", "raw_b", Align::right, 0, report::left_out(2)}}};

using Place = std::pair<modbus::RegisterTable, std::uint32_t>;
/// What one side holds.
using Image = std::map<Place, std::uint16_t>;

/// A parameter, or a register without a name, as both sides hold it.
struct Row {
  Parameter parameter;
  std::optional<Registers> a = std::nullopt;
  std::optional<Registers> b = std::nullopt;
};

template <typename Run>
void add_run(std::uint16_t first, const Run& run, Image& image) {
  std::uint32_t address = first;
  for (const std::uint16_t value : run.values) image[{run.table, address++}] = value;
}

Image image_of(const files::Dump& dump) {
  Image image;
  for (const files::DumpRun& run : dump.runs) add_run(run.from, run, image);
  return image;
}

/// All registers of a parameter, where the side has them all.
std::optional<Registers> registers_of(const Parameter& parameter, const Image& image) {
  Registers registers;
  const std::uint32_t first = parameter.address.value;
  const std::uint32_t end = first + catalogue::register_count(parameter.encoding);
  for (std::uint32_t at = first; at < end; ++at) {
    const auto found = image.find({parameter.table, at});
    if (found == image.end()) return std::nullopt;
    registers.push_back(found->second);
  }
  return registers;
}

/// How a register is called that is part of no parameter with a name.
Parameter unnamed(const Place& place, const Profile& profile) {
  const auto address = static_cast<std::uint16_t>(place.second);
  const auto& numbered = profile.numbered;
  if (numbered && numbered->table == place.first && numbered->from <= address &&
      address <= numbered->to) {
    return profile.numbered_parameter(address);
  }
  Parameter parameter;
  parameter.name = fmt::format("@{}:{}", modbus::to_text(place.first), address);
  parameter.table = place.first;
  parameter.address = {address};
  if (modbus::holds_bits(place.first)) parameter.encoding.kind = catalogue::Kind::bit;
  return parameter;
}

/// The value on one side; nothing where the side does not say it: its scale may stand elsewhere.
std::optional<catalogue::Value> value_of(const Parameter& parameter, const Registers& registers,
                                         const Image& image, const Profile& profile) {
  const auto other = [&](std::string_view name) {
    return profile.find(name).and_then([&](const Parameter& decider) -> Result<catalogue::Value> {
      const auto held = registers_of(decider, image);
      if (!held) return tl::unexpected(Error{.code = Errc::mismatch});
      return catalogue::decode(decider, *held);
    });
  };
  const auto value = catalogue::meant_by_others(parameter, other).and_then([&](const auto& meant) {
    return catalogue::decode_or_raw(meant, registers);
  });
  return value ? std::optional(*value) : std::nullopt;
}

/// Every register of either side, under the name of its parameter where that is whole on a side.
std::vector<Row> pair_up(const Image& a, const Image& b, const Profile& profile) {
  std::vector<Row> rows;
  Image left = a;
  left.insert(b.begin(), b.end());
  for (const Parameter& parameter : profile.parameters) {
    Row row{parameter, registers_of(parameter, a), registers_of(parameter, b)};
    if (!row.a && !row.b) continue;
    const std::uint32_t first = parameter.address.value;
    for (std::uint32_t at = 0; at < catalogue::register_count(parameter.encoding); ++at) {
      left.erase({parameter.table, first + at});
    }
    rows.push_back(std::move(row));
  }
  for (const auto& [place, value] : left) {
    Parameter parameter = unnamed(place, profile);
    Row row{parameter, registers_of(parameter, a), registers_of(parameter, b)};
    rows.push_back(std::move(row));
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Row& one, const Row& other) {
    return std::pair(one.parameter.table, one.parameter.address) <
           std::pair(other.parameter.table, other.parameter.address);
  });
  return rows;
}

bool is_selected(const std::string& name, const DiffOptions& options) {
  const auto matches = [&](const std::string& pattern) { return glob_match(pattern, name); };
  const auto& [wanted, ignored] = std::tie(options.patterns, options.ignored);
  return (wanted.empty() || std::any_of(wanted.begin(), wanted.end(), matches)) &&
         std::none_of(ignored.begin(), ignored.end(), matches);
}

struct Images {
  Image a;
  Image b;
};

report::Record row_record(const Row& row, const Images& images, const Profile& profile,
                          const std::string& target, const Clock& clock) {
  const auto value = [&](std::string key, const std::optional<Registers>& registers,
                         const Image& image) {
    if (!registers) return report::Field{std::move(key), report::Cell(), "-"};
    const auto decoded = value_of(row.parameter, *registers, image, profile);
    if (!decoded) return report::Field{std::move(key), report::Cell(), "?"};
    return report::Field{std::move(key), value_cell(*decoded), decoded->to_string()};
  };
  const auto raw = [](std::string key, const std::optional<Registers>& registers) {
    return registers ? report::Field{std::move(key), report::Words(*registers)}
                     : report::Field{std::move(key), report::Cell(), "-"};
  };
  const bool has_unit = row.parameter.unit != catalogue::torque_unit;
  return {.type = "diff",
          .target = target,
          .time = clock.wall(),
          .fields = {{"name", row.parameter.name.to_string()},
                     {"table", std::string(modbus::to_text(row.parameter.table))},
                     {"register", number(row.parameter.address.value)},
                     value("a", row.a, images.a),
                     value("b", row.b, images.b),
                     {"unit", text_or_null(has_unit ? row.parameter.unit.to_string() : "")},
                     raw("raw_a", row.a),
                     raw("raw_b", row.b)}};
}

Result<Outcome> compare_images(const Images& images, const Profile& profile,
                               const DiffOptions& options, const std::string& target,
                               Context& context) {
  auto rows = pair_up(images.a, images.b, profile);
  std::erase_if(
      rows, [&](const Row& row) { return !is_selected(row.parameter.name.to_string(), options); });
  if (rows.empty()) {
    return tl::unexpected(Error{.code = Errc::usage,
                                .message = "no register is left to compare",
                                .hint = "name more of them, or ignore fewer"});
  }
  Outcome outcome;
  Listing listing(context, columns);
  DiffResult result;
  for (const Row& row : rows) {
    ++(row.a == row.b ? result.same : result.different);
    if (row.a != row.b) listing.add(row_record(row, images, profile, target, context.clock));
  }
  outcome.succeed();
  if (result.different > 0) outcome.negate();
  return finish(listing, outcome, diff_summary(result, target), context);
}

/// The profile that a dump was made with; empty where it is not there.
Profile profile_of(const files::Dump& dump, const Context& context) {
  if (dump.profile.empty()) return {};
  auto profile = context.profiles.load(dump.profile);
  return profile ? std::move(*profile) : Profile();
}

std::vector<RegisterSpan> spans_of(const files::Dump& dump) {
  std::vector<RegisterSpan> spans;
  for (const files::DumpRun& run : dump.runs) {
    const auto last = static_cast<std::uint16_t>(run.from + run.values.size() - 1);
    spans.push_back({run.table, run.from, last});
  }
  return spans;
}

/// A tool that is asked for the registers of a dump.
class DumpDiff final : public Verb<std::monostate, Outcome> {
 public:
  DumpDiff(const DumpSides& sides, const DiffOptions& options, const Context& context)
      : sides_(&sides),
        options_(&options),
        need_(need_of_raw(spans_of(sides.a ? *sides.a : *sides.b), context)) {}

  [[nodiscard]] Need need() const override { return need_; }

  Result<Plan> plan(const Profile& /*profile*/, const Target& /*target*/) const override {
    return Plan();
  }

  Result<Done> perform(OpenTool& tool, const Plan& /*plan*/, Context& context) const override {
    const Profile& profile = tool.device.profile();
    const files::Dump& dump = sides_->a ? *sides_->a : *sides_->b;
    std::vector<link::RegisterRange> wanted;
    Images images;
    for (const RegisterSpan& span : spans_of(dump)) {
      for (const auto& range : askable(span, profile)) wanted.push_back(range);
    }
    auto survey = [&] {
      ProgressLine progress(context);
      return survey_registers(tool, wanted, usual_pause, context.clock,
                              progress.counter(tool.target.shown + ": reading"));
    }();
    if (survey.error) return tl::unexpected(std::move(*survey.error));
    Image held;
    for (const link::RegisterRun& run : survey.runs) add_run(run.first, run, held);
    images.a = sides_->a ? only(image_of(dump), wanted) : held;
    images.b = sides_->a ? held : only(image_of(dump), wanted);
    const Profile naming = profile.id.empty() ? profile_of(dump, context) : profile;
    return compare_images(images, naming, *options_, tool.target.shown, context);
  }

 private:
  /// What was asked for: registers that reading clears are not.
  static Image only(const Image& image, const std::vector<link::RegisterRange>& wanted) {
    Image asked;
    for (const link::RegisterRange& range : wanted) {
      const std::uint32_t first = range.first;
      asked.insert(image.lower_bound({range.table, first}),
                   image.lower_bound({range.table, first + range.count}));
    }
    return asked;
  }

  const DumpSides* sides_;
  const DiffOptions* options_;
  Need need_;
};

/// The profile by which registers are named; empty where the dumps do not agree, or it is not
/// there.
Result<Profile> naming_profile(const DumpSides& sides, const Context& context) {
  const std::string& named = context.common.profile;
  if (!named.empty()) return context.profiles.load(named);
  return sides.a->profile == sides.b->profile ? profile_of(*sides.a, context) : Profile();
}

std::optional<files::Dump> none() { return std::nullopt; }

Result<std::optional<files::Dump>> read_side(const std::string& text, const Context& context) {
  if (text == factory_defaults || !is_backup_file(text, context)) return none();
  const auto content = context.disk.read(text);
  if (!content || !files::is_dump(*content)) return none();
  return files::read_dump(*content, text).map([](files::Dump dump) {
    return std::optional(std::move(dump));
  });
}

}  // namespace

Result<DumpSides> read_dump_sides(const DiffOptions& options, const Context& context) {
  TRY_LET(auto a, read_side(options.a, context));
  TRY_LET(auto b, read_side(options.b, context));
  return DumpSides{std::move(a), std::move(b)};
}

Result<Outcome> diff_dumps(const DumpSides& sides, const DiffOptions& options, Context& context) {
  if (sides.a && sides.b) {
    return naming_profile(sides, context).and_then([&](const Profile& profile) {
      return compare_images({image_of(*sides.a), image_of(*sides.b)}, profile, options, {},
                            context);
    });
  }
  TRY_LET(auto other, resolve_side(sides.a ? options.b : options.a, context));
  if (!other.target) {
    const std::string_view what = other.is_defaults() ? "the defaults are" : "a backup is";
    return tl::unexpected(
        Error{.code = Errc::usage,
              .message = fmt::format("a dump is raw registers, and {} parameters by name", what),
              .hint = "compare a dump with another dump, or with a tool"});
  }
  return run_verb(DumpDiff(sides, options, context), {.tools = {std::move(*other.target)}}, 1,
                  context);
}

}  // namespace spindle::commands
