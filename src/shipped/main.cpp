// Makes the profiles of a folder part of the program: `spindle_tables FOLDER OUTPUT.cpp`. A fault
// of a profile ends it with file:line:column, as a compiler does.

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "shipped/table_writer.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"

namespace {

using namespace spindle;

std::vector<std::string> ids_in(const std::string& folder, const Disk& disk) {
  std::vector<std::string> ids;
  for (const std::filesystem::path file : disk.list(folder)) {
    if (file.extension() == ".yaml") ids.push_back(file.stem().string());
  }
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// Whether every rule holds.
bool is_sound(const files::ProfileStore& store, const std::string& path) {
  const auto findings = store.check(path);
  if (!findings) {
    fmt::print(stderr, "{}: {}\n", path, message_of(findings.error()));
    return false;
  }
  for (const files::Diagnostic& finding : *findings)
    fmt::print(stderr, "{}\n", finding.to_string());
  return findings->empty();
}

/// One line of the table of profiles.
Result<std::string> row_of(const files::ProfileStore& store, const std::string& folder,
                           const std::string& id, shipped::TableWriter& writer, const Disk& disk) {
  const std::string path = fmt::format("{}/{}.yaml", folder, id);
  TRY_LET(auto yaml, disk.read(path));
  TRY_LET(auto profile, store.load_any(path));
  TRY_LET(auto simulation, store.load_simulation(path));
  TRY_LET(auto codes, store.load_code_tables(path));
  if (profile.profile.id != id) {
    return tl::unexpected(Error{.code = Errc::bad_file,
                                .message = fmt::format("its id is '{}'", profile.profile.id),
                                .name = path});
  }
  profile.profile.path = {};
  const auto& bases = profile.profile.bases;
  const std::string extends = bases.empty() ? std::string() : bases.front().to_string();
  return fmt::format("    {{{}, {}, {}, {}, &{}, &{}, &{}}},\n", writer.quoted(id),
                     writer.quoted(yaml), writer.quoted(extends), profile.is_abstract,
                     writer.add(profile.profile), writer.add(simulation), writer.add(codes));
}

int write_tables(const std::string& folder, const std::string& output) {
  const Disk disk = posix::source_disk();
  const files::ProfileStore store({folder}, disk);
  shipped::TableWriter writer;
  std::string rows;
  bool sound = true;
  for (const std::string& id : ids_in(folder, disk)) {
    if (!is_sound(store, fmt::format("{}/{}.yaml", folder, id))) {
      sound = false;
      continue;
    }
    const auto row = row_of(store, folder, id, writer, disk);
    if (!row) {
      fmt::print(stderr, "{}\n", message_of(row.error()));
      sound = false;
      continue;
    }
    rows += *row;
  }
  if (!sound) return 1;
  const auto written =
      disk.write(output,
                 "// Written by spindle_tables from the profiles.\n"
                 "#include \"spindle/shipped/profiles.hpp\"\n\n"
                 "namespace spindle::shipped {\nnamespace {\n\nusing catalogue::Text;\n\n" +
                     writer.source() + "\nconstexpr files::ShippedProfile table[] = {\n" + rows +
                     "};\n\n}  // namespace\n\n"
                     "files::ShippedProfiles profiles() { return table; }\n\n}  // namespace "
                     "spindle::shipped\n",
                 Overwrite::allow, Privacy::usual);
  if (!written) fmt::print(stderr, "{}\n", describe(written.error()));
  return written ? 0 : 1;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    fmt::print(stderr, "usage: spindle_tables FOLDER OUTPUT.cpp\n");
    return 2;
  }
  return write_tables(arguments[1], arguments[2]);
}
