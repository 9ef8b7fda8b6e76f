#pragma once

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace spindle::test {

/// Files in memory that all of SQLite uses while it lives, and that forget what was not synced when
/// the power is cut. One connection at a time: locks always succeed.
class PowerDisk {
 public:
  /// What of the changes that were not synced outlives a cut: none of them, each or not by chance,
  /// or all of them, as when the program is killed and the computer goes on.
  enum class Keeps : std::uint8_t { nothing, some, all };

  /// Changes that are answered with an error, counted from 1.
  struct Trouble {
    std::size_t first = 0;
    std::size_t last = 0;
    int answer = SQLITE_IOERR;
  };

  PowerDisk() : usual_(sqlite3_vfs_find(nullptr)), files_of_(*usual_) {
    files_of_.iVersion = 2;
    files_of_.szOsFile = sizeof(Handle);
    files_of_.zName = "power-disk";
    files_of_.pAppData = this;
    files_of_.pNext = nullptr;
    files_of_.xOpen = open;
    files_of_.xDelete = erase;
    files_of_.xAccess = access;
    files_of_.xFullPathname = full_path;
    files_of_.xCurrentTimeInt64 = usual_->xCurrentTimeInt64;
    sqlite3_vfs_register(&files_of_, 1);
  }
  PowerDisk(const PowerDisk&) = delete;
  PowerDisk& operator=(const PowerDisk&) = delete;
  ~PowerDisk() {
    sqlite3_vfs_unregister(&files_of_);
    sqlite3_vfs_register(usual_, 1);
  }

  std::optional<std::size_t> dies_behind =
      std::nullopt;  ///< no change behind so many is carried out
  std::optional<Trouble> trouble = std::nullopt;
  bool refuses_new_files = false;  ///< as a folder that is not writable
  std::size_t changes = 0;
  std::size_t syncs = 0;

  /// The power goes and comes back. Connections that are open must be closed before.
  void cut(Keeps keeps, std::uint32_t seed) {
    std::mt19937 chance(seed);
    for (auto& [name, gone] : unsynced_deletions_) {
      if (keeps == Keeps::nothing && !files_.contains(name)) files_[name] = std::move(gone);
    }
    unsynced_deletions_.clear();
    for (auto& [name, file] : files_) {
      if (keeps != Keeps::all) {
        file->now = file->safe;
        for (const Change& change : file->pending) {
          if (keeps == Keeps::some && chance() % 2 == 0) apply(*file, change);
        }
      }
      file->safe = file->now;
      file->pending.clear();
      file->shared.clear();
    }
    dies_behind.reset();
    trouble.reset();
  }

  /// What a file holds, to be looked at or spoilt; null: there is none.
  std::string* content(const std::string& name) {
    const auto found = files_.find(name);
    return found == files_.end() ? nullptr : &found->second->now;
  }

 private:
  struct Change {
    std::size_t at = 0;
    std::optional<std::string> bytes = std::nullopt;  ///< empty: it ends there
  };

  static constexpr std::size_t region_size = 32'768;
  using Region = std::array<char, region_size>;

  struct File {
    std::string now = {};
    std::string safe = {};
    std::vector<Change> pending = {};
    std::vector<std::unique_ptr<Region>> shared = {};
  };

  struct Handle {
    sqlite3_file base;
    PowerDisk* disk;
    File* file;
    const char* name;
    bool is_temporary;
  };

  static void apply(File& file, const Change& change) {
    if (!change.bytes) {
      file.now.resize(change.at);
      return;
    }
    if (file.now.size() < change.at + change.bytes->size()) {
      file.now.resize(change.at + change.bytes->size());
    }
    file.now.replace(change.at, change.bytes->size(), *change.bytes);
  }

  [[nodiscard]] bool is_dead() const { return dies_behind && changes >= *dies_behind; }

  /// The answer to the next change.
  int count_change() {
    if (is_dead()) return SQLITE_IOERR;
    ++changes;
    const bool is_refused = trouble && trouble->first <= changes && changes <= trouble->last;
    return is_refused ? trouble->answer : SQLITE_OK;
  }

  static PowerDisk& disk_of(sqlite3_vfs* vfs) { return *static_cast<PowerDisk*>(vfs->pAppData); }
  static Handle& handle_of(sqlite3_file* file) { return *reinterpret_cast<Handle*>(file); }

  static int open(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out) {
    PowerDisk& disk = disk_of(vfs);
    Handle& handle = handle_of(file);
    handle.base.pMethods = nullptr;
    if (disk.is_dead()) return SQLITE_IOERR;
    const std::string path =
        name != nullptr ? name : "temporary-" + std::to_string(++disk.temporaries_);
    auto found = disk.files_.find(path);
    if (found == disk.files_.end()) {
      if ((flags & SQLITE_OPEN_CREATE) == 0 || disk.refuses_new_files) return SQLITE_CANTOPEN;
      found = disk.files_.emplace(path, std::make_unique<File>()).first;
      disk.unsynced_deletions_.erase(path);
    }
    handle = {.base = {.pMethods = &methods()},
              .disk = &disk,
              .file = found->second.get(),
              .name = found->first.c_str(),
              .is_temporary = (flags & SQLITE_OPEN_DELETEONCLOSE) != 0};
    if (out != nullptr) *out = flags;
    return SQLITE_OK;
  }

  static int erase(sqlite3_vfs* vfs, const char* name, int is_synced) {
    PowerDisk& disk = disk_of(vfs);
    if (const int answer = disk.count_change(); answer != SQLITE_OK) return answer;
    const auto found = disk.files_.find(name);
    if (found == disk.files_.end()) return SQLITE_IOERR_DELETE_NOENT;
    if (is_synced == 0) disk.unsynced_deletions_[name] = std::move(found->second);
    disk.files_.erase(found);
    return SQLITE_OK;
  }

  static int access(sqlite3_vfs* vfs, const char* name, int what, int* answer) {
    const auto found = disk_of(vfs).files_.find(name);
    const bool is_there = found != disk_of(vfs).files_.end();
    // As on Unix, an empty file is none.
    *answer = is_there && (what != SQLITE_ACCESS_EXISTS || !found->second->now.empty()) ? 1 : 0;
    return SQLITE_OK;
  }

  static int full_path(sqlite3_vfs* /*vfs*/, const char* name, int size, char* out) {
    sqlite3_snprintf(size, out, "%s", name);
    return SQLITE_OK;
  }

  static int close(sqlite3_file* file) {
    const Handle& handle = handle_of(file);
    if (handle.is_temporary) handle.disk->files_.erase(std::string(handle.name));
    return SQLITE_OK;
  }

  static int read(sqlite3_file* file, void* out, int size, sqlite3_int64 at) {
    const Handle& handle = handle_of(file);
    if (handle.disk->is_dead()) return SQLITE_IOERR_READ;
    const std::string& now = handle.file->now;
    const auto begin = std::min(static_cast<std::size_t>(at), now.size());
    const auto wanted = static_cast<std::size_t>(size);
    const std::size_t length = std::min(wanted, now.size() - begin);
    std::memset(out, 0, wanted);
    std::memcpy(out, now.data() + begin, length);
    return length == wanted ? SQLITE_OK : SQLITE_IOERR_SHORT_READ;
  }

  static int change(Handle& handle, Change change) {
    if (const int answer = handle.disk->count_change(); answer != SQLITE_OK) return answer;
    apply(*handle.file, change);
    handle.file->pending.push_back(std::move(change));
    return SQLITE_OK;
  }

  static int write(sqlite3_file* file, const void* bytes, int size, sqlite3_int64 at) {
    return change(handle_of(file), {.at = static_cast<std::size_t>(at),
                                    .bytes = std::string(static_cast<const char*>(bytes),
                                                         static_cast<std::size_t>(size))});
  }

  static int truncate(sqlite3_file* file, sqlite3_int64 size) {
    return change(handle_of(file), {.at = static_cast<std::size_t>(size)});
  }

  static int sync(sqlite3_file* file, int /*flags*/) {
    const Handle& handle = handle_of(file);
    if (const int answer = handle.disk->count_change(); answer != SQLITE_OK) return answer;
    ++handle.disk->syncs;
    handle.file->safe = handle.file->now;
    handle.file->pending.clear();
    return SQLITE_OK;
  }

  static int file_size(sqlite3_file* file, sqlite3_int64* size) {
    *size = static_cast<sqlite3_int64>(handle_of(file).file->now.size());
    return SQLITE_OK;
  }

  static int lock(sqlite3_file* /*file*/, int /*level*/) { return SQLITE_OK; }
  static int is_reserved(sqlite3_file* /*file*/, int* answer) {
    *answer = 0;
    return SQLITE_OK;
  }
  static int control(sqlite3_file* /*file*/, int /*code*/, void* /*value*/) {
    return SQLITE_NOTFOUND;
  }
  static int sector_size(sqlite3_file* /*file*/) { return 4096; }
  static int characteristics(sqlite3_file* /*file*/) { return 0; }

  static int map_shared(sqlite3_file* file, int region, int /*size*/, int may_extend,
                        void volatile** out) {
    auto& shared = handle_of(file).file->shared;
    const auto wanted = static_cast<std::size_t>(region);
    *out = nullptr;
    if (wanted >= shared.size() && may_extend == 0) return SQLITE_OK;
    if (shared.empty() && handle_of(file).disk->refuses_new_files) return SQLITE_CANTOPEN;
    while (wanted >= shared.size()) shared.push_back(std::make_unique<Region>());
    *out = shared[wanted]->data();
    return SQLITE_OK;
  }
  static int lock_shared(sqlite3_file* /*file*/, int /*from*/, int /*count*/, int /*flags*/) {
    return SQLITE_OK;
  }
  static void order_shared(sqlite3_file* /*file*/) {}
  static int unmap_shared(sqlite3_file* file, int is_last) {
    if (is_last != 0) handle_of(file).file->shared.clear();
    return SQLITE_OK;
  }

  static const sqlite3_io_methods& methods() {
    static const sqlite3_io_methods methods = {.iVersion = 2,
                                               .xClose = close,
                                               .xRead = read,
                                               .xWrite = write,
                                               .xTruncate = truncate,
                                               .xSync = sync,
                                               .xFileSize = file_size,
                                               .xLock = lock,
                                               .xUnlock = lock,
                                               .xCheckReservedLock = is_reserved,
                                               .xFileControl = control,
                                               .xSectorSize = sector_size,
                                               .xDeviceCharacteristics = characteristics,
                                               .xShmMap = map_shared,
                                               .xShmLock = lock_shared,
                                               .xShmBarrier = order_shared,
                                               .xShmUnmap = unmap_shared,
                                               .xFetch = nullptr,
                                               .xUnfetch = nullptr};
    return methods;
  }

  sqlite3_vfs* usual_;
  sqlite3_vfs files_of_;
  std::map<std::string, std::unique_ptr<File>> files_ = {};
  std::map<std::string, std::unique_ptr<File>> unsynced_deletions_ = {};
  std::size_t temporaries_ = 0;
};

}  // namespace spindle::test
