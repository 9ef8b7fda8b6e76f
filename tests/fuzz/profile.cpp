// Any text before the loaders of profiles and tools files. It may extend the shipped profiles.

#include <sys/mman.h>
#include <unistd.h>

#include "input.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/files/tools_file.hpp"
#include "spindle/posix/disk.hpp"

using namespace spindle;
using spindle::fuzz::require;

/// A profile of many parameters would fill the sanitizer's memory of what was freed, not ours.
extern "C" const char* __asan_default_options() {  // NOLINT: the sanitizer's name for it
  return "quarantine_size_mb=64";
}

namespace {

/// A file without a place in any folder.
class TextFile {
 public:
  explicit TextFile(ByteView text) : descriptor_(memfd_create("profile", MFD_CLOEXEC)) {
    require(descriptor_ >= 0);
    require(write(descriptor_, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  }
  ~TextFile() { close(descriptor_); }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(descriptor_); }

 private:
  int descriptor_;
};

/// A profile that loads can be used: all of it is found by its own name.
void check_profile(const catalogue::Profile& profile) {
  const auto all = profile.select({});
  require(all.has_value());
  for (const catalogue::Parameter& parameter : profile.parameters) {
    const auto found = profile.find(parameter.name);
    require(found && found->address == parameter.address);
    require(!parameter.source.empty());
    require(parameter.table != modbus::RegisterTable::input ||
            parameter.access == catalogue::Access::read_only);
  }
  for (const catalogue::Action& action : profile.actions) {
    require(profile.find_action(action.name).has_value());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const files::ProfileStore store({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk());
  const TextFile file({data, size});
  const auto profile = store.load(file.path());
  if (profile) check_profile(*profile);
  require(profile || profile.error().status() == ExitStatus::bad_file);
  const auto findings = store.check(file.path());
  // check() is the stricter one: what does not load has at least one fault.
  require(profile || !findings || !findings->empty());
  static_cast<void>(store.load_simulation(file.path()));
  static_cast<void>(store.load_error_codes(file.path()));
  const auto tools = files::load_tools(file.path(), posix::source_disk());
  require(tools || tools.error().status() == ExitStatus::bad_file);
  return 0;
}
