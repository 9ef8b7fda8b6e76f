#include "spindle/work/snapshot.hpp"

#include <algorithm>
#include <utility>

#include "spindle/base/duration.hpp"

namespace spindle::work {
namespace {

using catalogue::Missing;

/// Longer names are cut; file systems end at 255 bytes.
constexpr std::size_t longest_name = 100;

std::optional<Decimal> number_of(const std::optional<catalogue::Value>& value) {
  return value ? std::optional(value->number) : std::nullopt;
}

bool is_absent(const Error& error) {
  return error.exception == static_cast<std::uint8_t>(modbus::ExceptionCode::illegal_data_address);
}

/// What one step is worth, where that stands in another register and could be read.
std::optional<Decimal> step_of(const device::Reading& reading, const catalogue::Parameter& stored) {
  const bool is_known = !stored.scale_by.empty() && reading.parameter.scale_by.empty();
  return is_known ? std::optional(reading.parameter.encoding.scale) : std::nullopt;
}

/// Sorts one reading into values, holes and troubles. A value of which it is not known what its
/// steps are worth is kept as it is stored.
void add(device::Reading reading, const catalogue::Parameter& stored, const Target& target,
         Secrets secrets, ToolSnapshot& taken) {
  const auto step = step_of(reading, stored);
  if (!stored.scale_by.empty() && !step && reading.registers) {
    reading.parameter.unit = {};
    reading.parameter.scale_by = {};
    reading.value = decode_or_raw(stored, *reading.registers);
  }
  const bool is_secret = reading.parameter.secrecy == catalogue::Secrecy::secret;
  if (is_secret && secrets == Secrets::leave_out) {
    taken.snapshot.missing.push_back({reading.parameter, Missing::left_out});
    return;
  }
  if (const auto held = reading.held()) {
    taken.snapshot.entries.push_back({.parameter = reading.parameter,
                                      .raw = *reading.registers,
                                      .value = *held,
                                      .unit = unit_of(reading.parameter, target),
                                      .minimum = number_of(reading.minimum),
                                      .maximum = number_of(reading.maximum),
                                      .step = step});
    return;
  }
  const bool absent = is_absent(reading.value.error());
  if (!absent) taken.unreadable.push_back(reading.value.error());
  taken.snapshot.missing.push_back(
      {reading.parameter, absent ? Missing::absent : Missing::unreadable});
}

}  // namespace

std::optional<catalogue::SnapshotIdentity> identity_of(const device::Device& device) {
  const auto& identity = device.identity();
  if (!identity) return std::nullopt;
  return catalogue::SnapshotIdentity{.model = identity->tool_model,
                                     .model_code = identity->tool_model_code,
                                     .serial = identity->serial,
                                     .firmware = identity->firmware,
                                     .raw = identity->raw,
                                     .version = identity->version};
}

std::string unit_of(const catalogue::Parameter& parameter, const Target& target) {
  return parameter.unit == catalogue::torque_unit ? target.torque_unit : parameter.unit.to_string();
}

Result<ToolSnapshot> take_snapshot(OpenTool& tool, Secrets secrets, const Environment& environment,
                                   const link::Progress& progress) {
  const catalogue::Profile& profile = tool.device.profile();
  const auto stored = catalogue::stored_parameters(profile);
  TRY_LET(const auto readings, tool.device.read_each(stored, device::Limits::read, progress));
  ToolSnapshot taken{.snapshot = {.time = to_text(environment.clock.wall()),
                                  .version = std::string(environment.version),
                                  .target = tool.target.shown,
                                  .profile = profile.id,
                                  .fingerprint = catalogue::fingerprint(stored),
                                  .identity = identity_of(tool.device)}};
  taken.snapshot.entries.reserve(readings.size());
  for (std::size_t i = 0; i < readings.size(); ++i) {
    add(readings[i], stored[i], tool.target, secrets, taken);
  }
  return taken;
}

Result<files::BackupFile> read_backup_file(const std::string& path,
                                           const Environment& environment) {
  TRY_LET(auto text, environment.disk.read(path));
  return files::read_backup(text, path);
}

std::string file_name_of(const std::string& target) {
  constexpr std::string_view scheme_end = "://";
  const std::size_t scheme = target.find(scheme_end);
  std::string name =
      scheme == std::string::npos ? target : target.substr(scheme + scheme_end.size());
  const auto is_harmless = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '-' || c == '_';
  };
  std::replace_if(
      name.begin(), name.end(), [&](char c) { return !is_harmless(c); }, '_');
  name = name.substr(0, longest_name);
  if (name.empty() || name.front() == '.' || name.front() == '-') name.insert(0, 1, '_');
  return name;
}

}  // namespace spindle::work
