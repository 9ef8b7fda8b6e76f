#pragma once

#include <algorithm>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "spindle/base/disk.hpp"
#include "spindle/posix/disk.hpp"

namespace spindle::test {

/// A disk in memory, which can be full.
class MemoryDisk {
 public:
  /// What the program sees of it; the disk must outlive them.
  Disk functions() {
    return {.exists = [this](const std::string& path) { return files_.contains(plain(path)); },
            .absent = [this](const std::string& path) { return is_absent(path); },
            .same_file = real_.same_file,
            .list = [this](const std::string& folder) { return list(folder); },
            .read = [this](const std::string& path) { return read(path); },
            .write = [this](const std::string& path, std::string_view text, Overwrite overwrite,
                            Privacy) { return write(path, text, overwrite); },
            .append_line = [this](const std::string& path, std::string_view line) -> Result<void> {
              const std::lock_guard lock(mutex_);
              if (full_) return tl::unexpected(no_room(path));
              files_[plain(path)] += line;
              return {};
            },
            .append = [this](const std::string& path, std::string_view bytes) -> Result<void> {
              const std::lock_guard lock(mutex_);
              if (full_) return tl::unexpected(no_room(path));
              files_[plain(path)] += bytes;
              return {};
            },
            .make_folders = [this](const std::string& folder, Privacy) -> Result<void> {
              if (full_) return tl::unexpected(no_room(folder));
              return {};
            },
            .user = [] { return std::string("anna"); },
            .process = [] { return std::uint64_t{4242}; },
            // Profiles and tools files lie on the real disk, too.
            .read_trusted = [this](const std::string& path) -> Result<std::string> {
              return files_.contains(plain(path)) ? read(path) : real_.read_trusted(path);
            },
            .replace = [this](const std::string& path, std::string_view expected,
                              std::string_view text) -> Result<bool> {
              if (this->text(path) != expected) return false;
              return write(path, text, Overwrite::allow).map([] { return true; });
            }};
  }

  void put(const std::string& path, std::string text) { files_[plain(path)] = std::move(text); }
  void fill() { full_ = true; }
  void make_room() { full_ = false; }
  [[nodiscard]] const std::map<std::string, std::string>& files() const { return files_; }
  [[nodiscard]] std::string text(const std::string& path) const {
    const auto found = files_.find(plain(path));
    return found == files_.end() ? std::string() : found->second;
  }

 private:
  static std::string plain(const std::string& path) {
    return path.starts_with("./") ? path.substr(2) : path;
  }
  /// What is in a folder on either disk.
  std::vector<std::string> list(const std::string& folder) {
    std::vector<std::string> names = real_.list(folder);
    const std::string head = plain(folder) + "/";
    for (const auto& [path, text] : files_) {
      const std::string name = path.starts_with(head) ? path.substr(head.size()) : std::string();
      const bool is_there = std::find(names.begin(), names.end(), name) != names.end();
      if (!name.empty() && name.find('/') == std::string::npos && !is_there) names.push_back(name);
    }
    return names;
  }
  static Error no_room(const std::string& path) {
    return {.code = Errc::storage,
            .message = "cannot be written: No space left on device",
            .name = path};
  }
  /// What is installed on this machine is not seen.
  bool is_absent(const std::string& path) const {
    const bool is_seen = !path.starts_with("/etc/");
    return !files_.contains(plain(path)) && !(is_seen && !real_.absent(path));
  }
  Result<std::string> read(const std::string& path) {
    const auto found = files_.find(plain(path));
    if (found != files_.end()) return found->second;
    return tl::unexpected(Error{.code = Errc::bad_file, .message = "no such file", .name = path});
  }
  Result<void> write(const std::string& path, std::string_view text, Overwrite overwrite) {
    const std::lock_guard lock(mutex_);
    if (full_) return tl::unexpected(no_room(path));
    if (overwrite == Overwrite::refuse && files_.contains(plain(path))) {
      return tl::unexpected(Error{.code = Errc::usage, .message = "this file exists already"});
    }
    files_[plain(path)] = std::string(text);
    return {};
  }

  Disk real_ = posix::source_disk();
  std::map<std::string, std::string> files_ = {};
  bool full_ = false;
  std::mutex mutex_ = {};  // several tools are backed up side by side
};

}  // namespace spindle::test
