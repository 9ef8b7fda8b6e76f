#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "files/yaml_reader.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/files/register_map.hpp"

namespace spindle::files {

/// Where one entry or section of a profile was written. Valid as long as its document lives.
struct Origin {
  const YamlNode* entry = nullptr;
  const YamlNode* group = nullptr;  ///< shared defaults of a group of parameters; may be null
  std::size_t layer = 0;            ///< 0: the deepest base
  bool overlaps = false;            ///< the entry declares that it shares registers
  bool sound = true;                ///< nothing was wrong when it was read

  /// The value of a key, else the entry as a whole. Requires an entry.
  [[nodiscard]] SourceLocation of(std::string_view key) const;
};

/// A profile while its files are read, base first: what each layer says overrides key by key.
struct ProfileDraft {
  /// Its lists of parameters and actions are filled by finish().
  catalogue::Profile profile;
  std::vector<catalogue::Parameter> read_parameters;
  std::vector<catalogue::Action> read_actions;
  std::vector<catalogue::Parameter> event_fields;  ///< registers from the first one of the block
  std::size_t layers = 0;
  std::vector<Origin> parameters;  ///< side by side with read_parameters
  std::vector<Origin> actions;     ///< side by side with read_actions
  Origin top = {};
  Origin link = {};  ///< these: the last layer that says something of the section, or none
  Origin identity = {};
  Origin events = {};
  Origin limits = {};
  Origin numbered = {};
  Origin run = {};
  Origin refusals = {};
  Origin alarm_lists = {};
  Origin watched = {};
  Origin alarm_reset = {};
  Origin unlock = {};
  Origin torque_unit = {};
  Origin discovery = {};
  Origin learn = {};
  // Of the layer that is read now.
  Numbering numbering = Numbering::address;
  std::vector<std::string> dropped = {};
  std::optional<catalogue::Evidence> inherited_evidence = std::nullopt;
  /// Copies whose registers count from 0, which positions refer to.
  std::vector<std::unique_ptr<YamlNode>> renumbered = {};
  std::unordered_map<std::string, std::size_t> parameter_index = {};
  /// Parameters that were left out because not all of them could be read.
  std::unordered_set<std::string> half_read = {};
  /// There may be parameters whose names are not known: a base or a name could not be read.
  bool incomplete = false;

  /// Begins with a profile that is whole; `node` stands for all that it says.
  void begin_with(const catalogue::Profile& base, const YamlNode& node);

  /// Completes the profile. Leaves out every entry and section in which something was wrong, so
  /// that rules speak of what could be read. Positions of the others stay valid.
  void finish();

  void finish_event_fields(catalogue::EventSpec& spec);

  /// Whether a name is that of no parameter, as far as can be known.
  [[nodiscard]] bool lacks(const std::string& name) const {
    return !incomplete && !parameter_index.contains(name) && !half_read.contains(name);
  }
};

/// What must be known of a document before anything else is read from it.
struct ProfileHead {
  std::string extends;  ///< id of the base; empty: none
  SourceLocation extends_at = {};
  bool abstract = false;
};

/// Also checks the format number.
ProfileHead read_head(const YamlNode& document, Diagnostics& findings);

/// Lays one first document over the draft. Missing, unknown and ill-typed keys are findings.
void read_profile(const YamlNode& document, ProfileDraft& draft, Diagnostics& findings);

/// What the documents behind the first are about.
enum class Part : std::uint8_t { texts, simulation };

/// The document of this part, among those behind the first; null when there is none. Documents
/// of unknown parts, and second ones of the same part, are findings.
const YamlNode* find_part(const std::vector<YamlNode>& documents, Part part, Diagnostics& findings);

/// `part: texts`, laid over what is there.
void read_texts(const YamlNode& document, catalogue::CodeTables& tables, Diagnostics& findings);

/// A map of codes, or a list of such maps with the evidence that each shares.
void read_codes(const YamlNode& node, catalogue::CodeTexts& codes, Diagnostics& findings);

/// `part: simulation`.
catalogue::SimulationSpec read_simulation(const YamlNode& document, Diagnostics& findings);

/// Simulation patterns must mean something, and start values fit: only check() pays for this.
void check_simulation(const catalogue::Profile& profile, const YamlNode& document,
                      Diagnostics& findings);

}  // namespace spindle::files
