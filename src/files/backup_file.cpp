#include "spindle/files/backup_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "files/document_form.hpp"
#include "files/fields.hpp"
#include "files/identity_lines.hpp"
#include "files/known_keys.hpp"
#include "files/yaml_reader.hpp"
#include "files/yaml_text.hpp"
#include "spindle/base/text.hpp"
#include "spindle/base/utf8.hpp"
#include "spindle/catalogue/danger.hpp"

namespace spindle::files {
namespace {

using catalogue::Missing;
using catalogue::MissingEntry;
using catalogue::Parameter;
using catalogue::Profile;
using catalogue::Snapshot;
using catalogue::SnapshotEntry;
using catalogue::SnapshotIdentity;
using catalogue::Value;

constexpr std::string_view kind = "spindle-backup";
constexpr std::uint64_t last_register = std::numeric_limits<std::uint16_t>::max();
/// The longest value that any encoding has.
constexpr std::size_t most_words = 125;

constexpr auto missing_words = enum_table<Missing>({{"absent", Missing::absent},
                                                    {"unreadable", Missing::unreadable},
                                                    {"left-out", Missing::left_out}});

// ---- writing ----

constexpr std::string_view no_value = "null";

std::string to_text(const Registers& raw) {
  if (raw.size() == 1) return std::to_string(raw.front());
  return fmt::format("[{}]", fmt::join(raw, ", "));
}

/// Where a parameter is; the usual table needs no word.
std::string place_of(const Parameter& parameter) {
  std::string text =
      fmt::format("name: {}, register: {}", scalar(parameter.name), parameter.address.value);
  if (parameter.table != modbus::RegisterTable::holding) {
    text += fmt::format(", table: {}", catalogue::to_text(parameter.table));
  }
  return text;
}

/// A number as it is, with all its decimals; anything else as text; null where there is none.
std::string value_in_file(const Value& value) {
  if (value.content == catalogue::Content::none) return std::string(no_value);
  if (!value.label.empty()) return quoted(value.label);
  return value.is_number() ? value.exact() : quoted(value.exact());
}

std::string line_of(const SnapshotEntry& entry) {
  std::string line =
      fmt::format("  - {{{}, raw: {}", place_of(entry.parameter), to_text(entry.raw));
  // Bytes that are no characters have no place in YAML; then the registers say it all.
  if (entry.value.content != catalogue::Content::raw && is_utf8(entry.value.exact())) {
    line += fmt::format(", value: {}", value_in_file(entry.value));
  }
  if (entry.step) line += fmt::format(", step: {}", entry.step->to_string());
  if (!entry.unit.empty()) line += fmt::format(", unit: {}", scalar(entry.unit));
  if (entry.minimum) line += fmt::format(", minimum: {}", entry.minimum->to_string());
  if (entry.maximum) line += fmt::format(", maximum: {}", entry.maximum->to_string());
  return line + "}\n";
}

std::string lines_of_missing(const Snapshot& snapshot) {
  if (snapshot.missing.empty()) return {};
  std::string lines = "missing:\n";
  for (const MissingEntry& entry : snapshot.missing) {
    lines += fmt::format("  - {{{}, why: {}}}\n", place_of(entry.parameter),
                         missing_words.text(entry.why));
  }
  return lines;
}

// ---- reading the form ----

std::optional<Registers> read_raw(const YamlNode& node, Diagnostics& findings) {
  Registers raw;
  const auto add = [&](const YamlNode& item) {
    const auto number = to_unsigned(item, last_register, findings);
    if (number) raw.push_back(static_cast<std::uint16_t>(*number));
    return number.has_value();
  };
  if (node.kind == YamlNode::Kind::scalar) return add(node) ? std::optional(raw) : std::nullopt;
  if (!expect(node, YamlNode::Kind::sequence, findings)) return std::nullopt;
  if (node.items.empty() || node.items.size() > most_words) {
    findings.add(node.at, fmt::format("a value has 1 to {} registers", most_words));
    return std::nullopt;
  }
  return std::all_of(node.items.begin(), node.items.end(), add) ? std::optional(raw) : std::nullopt;
}

constexpr Field<BackupLine> place_fields[] = {
    field<&BackupLine::name>("name", Need::required),
    field<&BackupLine::address>("register", Need::required),
    word<modbus::table_words, &BackupLine::table>("table"),
};

void read_raw_value(const YamlNode& node, BackupLine& line, const Asked& asked) {
  line.raw = read_raw(node, asked.findings);
  line.value_at = node.at;
}

void read_value(const YamlNode& node, BackupLine& line, const Asked& asked) {
  if (node.kind == YamlNode::Kind::nothing) {
    line.value = no_value;
    line.value_at = node.at;
    return;
  }
  line.value = to_text(node, asked.findings);
  line.value_at = node.at;
}

constexpr Field<BackupLine> entry_fields[] = {
    custom("raw", Need::optional, "one register, or a list of them", read_raw_value),
    custom("value", Need::optional, "text", read_value),
    field<&BackupLine::step>("step"),
    field<&BackupLine::unit>("unit"),
    field<&BackupLine::minimum>("minimum"),
    field<&BackupLine::maximum>("maximum"),
};

constexpr Field<BackupLine> missing_fields[] = {
    word<missing_words, &BackupLine::missing>("why", Need::required, "reason"),
};

template <std::size_t count>
void read_line(const Field<BackupLine> (&fields)[count], const YamlNode& node, BackupFile& file,
               Diagnostics& findings) {
  YamlMap map(node, findings);
  BackupLine line;
  line.at = node.at;
  line.value_at = line.at;
  read_fields(place_fields, map, line);
  read_fields(fields, map, line);
  map.finish();
  file.lines.push_back(std::move(line));
}

void read_entry(const YamlNode& node, BackupFile& file, Diagnostics& findings) {
  read_line(entry_fields, node, file, findings);
  const bool has_value = node.find("raw") != nullptr || node.find("value") != nullptr;
  if (has_value || node.kind != YamlNode::Kind::map) return;
  findings.add(node.at, "neither 'value' nor 'raw' is given");
}

void read_missing(const YamlNode& node, BackupFile& file, Diagnostics& findings) {
  read_line(missing_fields, node, file, findings);
}

/// Reads a list line by line; returns how many lines it has.
template <typename Read>
std::size_t read_lines(const YamlNode* list, Read read, BackupFile& file, Diagnostics& findings) {
  if (list == nullptr || list->kind == YamlNode::Kind::nothing) return 0;
  if (!expect(*list, YamlNode::Kind::sequence, findings)) return 0;
  for (const YamlNode& node : list->items) read(node, file, findings);
  return list->items.size();
}

constexpr Field<Snapshot> profile_fields[] = {
    field<&Snapshot::profile>("id", Need::required),
    field<&Snapshot::fingerprint>("fingerprint", Need::required),
};

/// How many lines were written.
struct Counts {
  std::optional<std::uint32_t> parameters = std::nullopt;
  std::optional<std::uint32_t> missing = std::nullopt;
};

constexpr Field<Counts> count_fields[] = {
    field<&Counts::parameters>("parameters", Need::required),
    field<&Counts::missing>("missing", Need::required),
};

struct BackupDocument {
  Snapshot head = {};
  const YamlNode* parameters = nullptr;
  const YamlNode* missing = nullptr;
  const YamlNode* end = nullptr;
};

void skip(const YamlNode&, BackupDocument&, const Asked&) {}

constexpr Field<BackupDocument> document_fields[] = {
    // Both were checked before anything else is read.
    custom("format", Need::required, "1", skip),
    custom("kind", Need::required, kind, skip),
    field<&BackupDocument::head, &Snapshot::time>("time", Need::required),
    field<&BackupDocument::head, &Snapshot::version>("spindle", Need::required),
    field<&BackupDocument::head, &Snapshot::target>("target", Need::required),
    map_of<profile_fields, &BackupDocument::head>("profile", Need::required),
    map_of<identity_fields, &BackupDocument::head, &Snapshot::identity>("identity"),
    field<&BackupDocument::parameters>("parameters", Need::required)
        .with(keys_of<place_fields, entry_fields>),
    field<&BackupDocument::missing>("missing").with(keys_of<place_fields, missing_fields>),
    field<&BackupDocument::end>("end", Need::required).with(keys_of<count_fields>),
};

void check_count(const YamlNode& end, std::string_view key, std::optional<std::uint32_t> count,
                 std::size_t lines, Diagnostics& findings) {
  if (!count || *count == lines) return;
  findings.add(end.find(key)->at,
               fmt::format("{} lines of '{}' were written, but {} are there", *count, key, lines));
}

SourceLocation end_of(std::string_view text, std::size_t file) {
  const auto lines = std::count(text.begin(), text.end(), '\n');
  return {file, static_cast<int>(lines) + 1, 1};
}

void read_document(const YamlNode& document, std::string_view text, BackupFile& file,
                   Diagnostics& findings) {
  if (!has_form(document, "backup", findings)) return;
  if (document.find("end") == nullptr) {
    findings.add(end_of(text, document.at.file),
                 "the end marker is missing: the file is cut off; take another backup");
    return;
  }
  BackupDocument parts;
  read_map(document_fields, document, parts, findings);
  file.head = std::move(parts.head);
  const std::size_t values = read_lines(parts.parameters, read_entry, file, findings);
  const std::size_t others = read_lines(parts.missing, read_missing, file, findings);
  Counts counts;
  read_map(count_fields, *parts.end, counts, findings);
  check_count(*parts.end, "parameters", counts.parameters, values, findings);
  check_count(*parts.end, "missing", counts.missing, others, findings);
}

// ---- reading the meaning ----

/// What a stored parameter's registers are called in a profile.
class Names {
 public:
  explicit Names(const Profile& profile)
      : profile_(&profile), dangers_(profile), stored_(catalogue::stored_parameters(profile)) {
    for (const Parameter& parameter : stored_) {
      by_name_.emplace(parameter.name, &parameter);
      by_register_.emplace(std::pair(parameter.table, parameter.address.value), &parameter);
    }
  }

  /// The parameter that a line means, where it is no setting.
  [[nodiscard]] std::optional<Parameter> find_dangerous(const BackupLine& line) const {
    if (by_name_.contains(line.name) || line.name.starts_with('@')) return std::nullopt;
    auto meant = profile_->find(line.name);
    const bool at_its_place =
        meant && meant->address.value == line.address && meant->table == line.table;
    if (!at_its_place || !dangers_.find(*meant)) return std::nullopt;
    return std::move(*meant);
  }

  /// The stored parameter that a line means; a finding where there is none.
  const Parameter* find(const BackupLine& line, const SourceLocation& at,
                        Diagnostics& findings) const {
    if (const auto named = by_name_.find(line.name); named != by_name_.end()) {
      return at_its_register(*named->second, line, at, findings) ? named->second : nullptr;
    }
    const auto meant = profile_->find(line.name);
    if (!meant || line.name.starts_with('@')) {
      const std::string hint = meant ? std::string() : hint_of(meant.error());
      findings.add(at, fmt::format("'{}' is no stored parameter of profile {}{}{}", line.name,
                                   profile_->id, hint.empty() ? "" : "; ", hint));
      return nullptr;
    }
    if (!at_its_register(*meant, line, at, findings)) return nullptr;
    // Another version of the profile has a name for what was a number, or the other way round.
    const auto same = by_register_.find(std::pair(meant->table, meant->address.value));
    const bool alike =
        same != by_register_.end() && same->second->encoding.kind == meant->encoding.kind;
    if (alike) return same->second;
    findings.add(at, fmt::format("'{}' is part of another parameter in profile {}", line.name,
                                 profile_->id));
    return nullptr;
  }

  /// The parameter under the line's own name, whose scale its value was written with.
  [[nodiscard]] Parameter as_written(const BackupLine& line, const Parameter& stored) const {
    return profile_->find(line.name).value_or(stored);
  }

 private:
  bool at_its_register(const Parameter& parameter, const BackupLine& line, const SourceLocation& at,
                       Diagnostics& findings) const {
    if (parameter.address.value == line.address && parameter.table == line.table) return true;
    findings.add(at, fmt::format("'{}' is register {} ({}) in profile {}, not {} ({})", line.name,
                                 parameter.address.value, catalogue::to_text(parameter.table),
                                 profile_->id, line.address, catalogue::to_text(line.table)));
    return false;
  }

  const Profile* profile_;
  catalogue::Dangers dangers_;
  std::vector<Parameter> stored_;
  std::map<std::string_view, const Parameter*> by_name_ = {};
  std::map<std::pair<modbus::RegisterTable, std::uint16_t>, const Parameter*> by_register_ = {};
};

/// Whether a text is how a bit field is shown while any of its names count.
bool names_bits(std::string_view text, const Registers& raw, const Parameter& parameter) {
  return std::any_of(
      parameter.bits.begin(), parameter.bits.end(), [&](const catalogue::BitName& bit) {
        const auto shown = catalogue::decode(catalogue::with_bits_for(parameter, bit.when), raw);
        return shown && text == shown->label;
      });
}

/// Whether a text says this value: its label in any case, or the same number.
bool says(std::string_view text, const Value& value, const Parameter& parameter) {
  if (!value.label.empty() && text == value.label) return true;
  if (names_bits(text, value.held, parameter)) return true;
  if (value.content == catalogue::Content::none) return text == no_value;
  if (!value.is_number()) return text == value.exact();
  if (const auto number = Decimal::parse(text)) return *number == value.number;
  const auto parsed = catalogue::parse_value(parameter, text);
  return parsed && *parsed == value;
}

/// The registers that a line stands for; a finding where it is not clear.
std::optional<Registers> registers_of(const BackupLine& line, const Parameter& parameter,
                                      const SourceLocation& at, Diagnostics& findings) {
  if (!line.raw) {
    // Of names that only count at times it is not known which bits are meant.
    const Parameter meant = catalogue::with_bits_for(parameter, std::nullopt);
    auto registers =
        catalogue::parse_exact_value(meant, *line.value).and_then([&](const Value& value) {
          return catalogue::encode(meant, value,
                                   Registers(catalogue::register_count(meant.encoding)));
        });
    if (registers) return *std::move(registers);
    const std::string hint = hint_of(registers.error());
    findings.add(at, fmt::format("{}: {}{}{}", line.name, message_of(registers.error()),
                                 hint.empty() ? "" : "; ", hint));
    return std::nullopt;
  }
  const auto value = catalogue::decode_or_raw(parameter, *line.raw);
  if (!value) {
    findings.add(at, fmt::format("{}: {} registers, but {} has {}", line.name, line.raw->size(),
                                 catalogue::to_text(parameter.encoding.kind),
                                 catalogue::register_count(parameter.encoding)));
    return std::nullopt;
  }
  if (line.value && !says(*line.value, *value, parameter)) {
    findings.add(at, fmt::format("{}: value '{}' and raw {} ({}) say different things; leave out "
                                 "the one that is wrong",
                                 line.name, *line.value, to_text(*line.raw), value->to_string()));
    return std::nullopt;
  }
  return line.raw;
}

/// The parameter with steps of this worth, where that is not in the profile; counted in steps where
/// it is not known.
Parameter with_step(Parameter parameter, const std::optional<Decimal>& step) {
  if (step) parameter.encoding.scale = *step;
  parameter.scale_by = {};
  return parameter;
}

class BackupResolver {
 public:
  BackupResolver(const BackupFile& file, const Profile& profile)
      : names_(profile), snapshot_(file.head) {
    findings_.add_file(file.path);
  }

  Result<Snapshot> run(const std::vector<BackupLine>& lines) {
    for (const BackupLine& line : lines) take(line);
    if (!findings_.empty()) return tl::unexpected(findings_.error());
    return std::move(snapshot_);
  }

 private:
  void take(const BackupLine& line) {
    if (const auto dangerous = names_.find_dangerous(line)) {
      snapshot_.dangerous.push_back(*dangerous);
      return;
    }
    const Parameter* parameter = names_.find(line, line.at, findings_);
    if (parameter == nullptr) return;
    if (!seen_.insert(parameter->name).second) {
      findings_.add(line.at, fmt::format("register {} is here twice", line.address));
      return;
    }
    if (line.missing) {
      snapshot_.missing.push_back({*parameter, *line.missing});
      return;
    }
    const bool has_step = line.step.has_value();
    if (has_step && (parameter->scale_by.empty() || *line.step == Decimal(0))) {
      findings_.add(line.at, fmt::format("{}: its steps are not worth {} in profile {}", line.name,
                                         line.step->to_string(), snapshot_.profile));
      return;
    }
    if (!has_step && !parameter->scale_by.empty() && !line.raw) {
      findings_.add(line.at, fmt::format("{}: key 'step' is missing, which says what a step of it "
                                         "is worth",
                                         line.name));
      return;
    }
    const Parameter meant = with_step(*parameter, line.step);
    auto raw = registers_of(line, with_step(names_.as_written(line, *parameter), line.step),
                            line.value_at, findings_);
    if (!raw) return;
    auto value = catalogue::decode_or_raw(meant, *raw);
    if (!value) return;  // it has as many registers under both names
    snapshot_.entries.push_back({.parameter = meant,
                                 .raw = std::move(*raw),
                                 .value = std::move(*value),
                                 .unit = line.unit,
                                 .minimum = line.minimum,
                                 .maximum = line.maximum,
                                 .step = line.step});
  }

  Names names_;
  Diagnostics findings_ = {};
  Snapshot snapshot_;
  std::set<std::string> seen_ = {};
};

}  // namespace

std::string render_backup(const Snapshot& snapshot) {
  std::string text =
      "# A backup of one tool, one parameter a line. A value may be edited: change 'value' and\n"
      "# leave out 'raw', or change both. 'spindle diff' compares it, 'spindle restore' writes "
      "it.\n";
  text += fmt::format("format: {}\nkind: {}\n", known_format, kind);
  text += fmt::format("time: {}\n", quoted(snapshot.time));
  text += fmt::format("spindle: {}\n", quoted(snapshot.version));
  text += fmt::format("target: {}\n", quoted(snapshot.target));
  text += fmt::format("profile: {{id: {}, fingerprint: {}}}\n", scalar(snapshot.profile),
                      quoted(snapshot.fingerprint));
  if (snapshot.identity) text += line_of(*snapshot.identity);
  text += snapshot.entries.empty() ? "parameters: []\n" : "parameters:\n";
  for (const SnapshotEntry& entry : snapshot.entries) text += line_of(entry);
  text += lines_of_missing(snapshot);
  text += fmt::format("end: {{parameters: {}, missing: {}}}\n", snapshot.entries.size(),
                      snapshot.missing.size());
  return text;
}

Result<BackupFile> read_backup(std::string_view text, const std::string& path) {
  Diagnostics findings;
  const std::size_t number = findings.add_file(path);
  BackupFile file{.path = path};
  const std::vector<YamlNode> documents = parse_yaml(text, number, Documents::all, findings);
  if (!findings.empty()) return tl::unexpected(findings.error());
  if (documents.empty()) {
    findings.add({number, 1, 1}, "the file is empty");
  } else if (documents.size() > 1) {
    findings.add(documents[1].at, "a second document has no meaning here");
  } else {
    read_document(documents.front(), text, file, findings);
  }
  if (!findings.empty()) return tl::unexpected(findings.error());
  return file;
}

Result<Snapshot> resolve_backup(const BackupFile& file, const Profile& profile) {
  return BackupResolver(file, profile).run(file.lines);
}

std::vector<KeyList> backup_keys() { return {{"document", keys_of<document_fields>()}}; }

}  // namespace spindle::files
