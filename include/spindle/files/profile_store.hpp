#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "spindle/base/disk.hpp"
#include "spindle/base/error.hpp"
#include "spindle/catalogue/profile.hpp"
#include "spindle/files/finding.hpp"
#include "spindle/files/shipped_profile.hpp"

namespace spindle::files {

/// The version of the profile format that is read (key `format`).
inline constexpr std::int64_t profile_format = 1;

/// Stands for the file of a profile that is part of the program and in none of the folders.
inline constexpr std::string_view built_in = "(built in)";

/// A profile that can be named.
struct ProfileEntry {
  std::string id;
  std::string path;  ///< or `built_in`
};

/// A profile of a product, or a base of such profiles.
struct AnyProfile {
  catalogue::Profile profile;
  bool is_abstract = false;  ///< only a base
};

/// Whether a profile is named by its file rather than by its id: it has a '/' or ends in ".yaml".
bool names_profile_file(std::string_view text);

/// Where profiles are found. The first folder that has ID.yaml wins; the profiles of the program
/// come last. A file that is, with its bases, the one that a profile of the program was made from
/// is not parsed: its tables are used. Each profile is made once however often it is asked for, and
/// copies share it. Several threads may ask.
class ProfileStore {
 public:
  /// Every file, bases included, has to be trusted. `shipped` must outlive the store.
  ProfileStore(std::vector<std::string> folders, Disk disk, ShippedProfiles shipped = {});
  ProfileStore(ProfileStore&&) noexcept;
  ProfileStore& operator=(ProfileStore&&) noexcept;
  ~ProfileStore();

  /// By id, or by path when the text has a '/' or ends in ".yaml". Follows `extends`. Error
  /// `bad_file` (status 3) with the first finding as message and how many there are, or
  /// `unknown_name` with a suggestion. Reads the simulation part not at all.
  [[nodiscard]] Result<catalogue::Profile> load(std::string_view name_or_file) const;

  /// The same, and of one that is only a base.
  [[nodiscard]] Result<AnyProfile> load_any(std::string_view name_or_file) const;

  /// The start state for the simulated tool (the file's YAML document `part: simulation`, or that
  /// of the nearest file it extends); empty facts where there is none.
  [[nodiscard]] Result<catalogue::SimulationSpec> load_simulation(
      std::string_view name_or_file) const;

  /// Meanings and remedies of the product's error and alarm codes (the file's `part: texts`, over
  /// those of the files it extends). Apart from load(), so that only commands that show a code pay
  /// for them. Empty when the profile has none.
  [[nodiscard]] Result<catalogue::CodeTexts> load_error_codes(std::string_view name_or_file) const;

  /// The same with all tables of codes.
  [[nodiscard]] Result<catalogue::CodeTables> load_code_tables(std::string_view name_or_file) const;

  /// Every fault of a file and of those it extends, all documents; empty when it is valid. Error
  /// only when the file cannot be read or found.
  [[nodiscard]] Result<std::vector<Diagnostic>> check(std::string_view name_or_file) const;

  /// Every valid profile that list() names, sorted by id. Files with faults are left out: one of a
  /// user's must not hide the others.
  [[nodiscard]] std::vector<catalogue::Profile> load_all() const;

  /// All profiles in all folders and in the program, sorted by id, shadowed ones left out. Base
  /// profiles that say `abstract: true` are left out.
  [[nodiscard]] std::vector<ProfileEntry> list() const;

 private:
  struct Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace spindle::files
