// Any text before the loader of backups. What loads is written again and loads the same.

#include "input.hpp"
#include "spindle/files/backup_file.hpp"
#include "spindle/files/profile_store.hpp"
#include "spindle/posix/disk.hpp"

using namespace spindle;
using spindle::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const catalogue::Profile profile =
      files::ProfileStore({SPINDLE_SOURCE_DIR "/profiles"}, posix::source_disk())
          .load("doga-bm")
          .value();
  const std::string text = fuzz::Input(data, size).text();
  const auto file = files::read_backup(text, "backup.yaml");
  require(file || file.error().status() == ExitStatus::bad_file);
  if (!file) return 0;
  const auto snapshot = files::resolve_backup(*file, profile);
  require(snapshot || snapshot.error().status() == ExitStatus::bad_file);
  if (!snapshot) return 0;
  const std::string rendered = files::render_backup(*snapshot);
  const auto again =
      files::read_backup(rendered, "again.yaml").and_then([](const files::BackupFile& read) {
        return files::resolve_backup(read, profile);
      });
  require(again.has_value());
  require(files::render_backup(*again) == rendered);
  require(catalogue::compare(*snapshot, *again, {}).differences.empty());
  return 0;
}
