#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/error.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/files/finding.hpp"
#include "spindle/files/read_text.hpp"

namespace spindle::files {

/// The version of the profile format that is read (key `format`).
inline constexpr std::int64_t profile_format = 1;

/// A profile that can be named.
struct ProfileEntry {
  std::string id;
  std::string path;
};

/// Whether a profile is named by its file rather than by its id: it has a '/' or ends in ".yaml".
bool names_profile_file(std::string_view text);

/// Where profiles are found. The first folder that has ID.yaml wins.
class ProfileStore {
 public:
  /// Every file, bases included, is read by `read`.
  explicit ProfileStore(std::vector<std::string> folders, ReadText read = read_text_file)
      : folders_(std::move(folders)), read_(std::move(read)) {}

  /// By id, or by path when the text has a '/' or ends in ".yaml". Follows `extends`. Error
  /// `bad_file` (status 3) with the first finding as message and how many there are, or
  /// `unknown_name` with a suggestion. Reads the simulation part not at all.
  [[nodiscard]] Result<catalogue::Profile> load(std::string_view name_or_file) const;

  /// The start state for the simulated tool (the file's YAML document `part: simulation`, or that
  /// of the nearest file it extends); empty facts where there is none.
  [[nodiscard]] Result<catalogue::SimulationFacts> load_simulation(
      std::string_view name_or_file) const;

  /// Meanings and remedies of the product's error and alarm codes (the file's `part: texts`, over
  /// those of the files it extends). Apart from load(), so that only commands that show a code pay
  /// for them. Empty when the profile has none.
  [[nodiscard]] Result<catalogue::CodeTexts> load_error_codes(std::string_view name_or_file) const;

  /// The same with all tables of codes.
  [[nodiscard]] Result<catalogue::CodeTables> load_code_tables(std::string_view name_or_file) const;

  /// Every fault of a file and of those it extends, all documents; empty when it is valid. Error
  /// only when the file can not be read or found.
  [[nodiscard]] Result<std::vector<Finding>> check(std::string_view name_or_file) const;

  /// Every valid profile that list() names, sorted by id; each file is read once. Files with faults
  /// are left out: one of a user's must not hide the others.
  [[nodiscard]] std::vector<catalogue::Profile> load_all() const;

  /// All profiles in all folders, sorted by id, shadowed ones left out. Base profiles that say
  /// `abstract: true` are left out.
  [[nodiscard]] std::vector<ProfileEntry> list() const;

 private:
  std::vector<std::string> folders_;
  ReadText read_;
};

}  // namespace spindle::files
