#include "posix/line_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <optional>

#include "posix/port_holder.hpp"
#include "posix/runtime_folder.hpp"

namespace spindle::posix {
namespace {

/// What a file of late answers holds; it is read on the machine that wrote it.
struct Note {
  Duration::rep until = 0;
  std::int64_t since = 0;
};

/// Further ahead is no time that a program of this run of the system left.
constexpr Duration longest_late = std::chrono::minutes(10);

std::string file_name(const std::string& line, std::string_view ending) {
  std::string name = line + std::string(ending);
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

}  // namespace

LineLock lock_line(const std::string& name) {
  const auto folder = own_runtime_folder();
  if (!folder) return {};
  const std::string path = fmt::format("{}/{}", *folder, file_name(name, ".lock"));
  Descriptor lock(
      ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR));
  if (!lock.valid()) return {};
  if (::flock(lock.number(), LOCK_EX | LOCK_NB) == 0) return {.file = std::move(lock)};
  if (errno != EWOULDBLOCK) return {};
  std::string holder = port_holder(path, lock.number());
  return {.holder = holder.empty() ? "another program" : std::move(holder)};
}

TimePoint late_answers_until(const LineName& line, TimePoint now) {
  const auto folder = own_runtime_folder();
  if (!folder) return {};
  const std::string path = fmt::format("{}/{}", *folder, file_name(line.text, ".late"));
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (!file.valid()) return {};
  Note note = {};
  const bool whole = ::read(file.number(), &note, sizeof note) == sizeof note;
  const TimePoint until = TimePoint(Duration(note.until));
  const bool counts = whole && note.since == line.since;
  if (counts && until > now && until - now <= longest_late) return until;
  ::unlink(path.c_str());
  return {};
}

void leave_late_answers(const LineName& line, TimePoint until) {
  const auto folder = own_runtime_folder();
  if (!folder) return;
  const std::string path = fmt::format("{}/{}", *folder, file_name(line.text, ".late"));
  const Descriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | O_NOFOLLOW, S_IRUSR | S_IWUSR));
  if (!file.valid()) return;
  const Note note = {.until = until.time_since_epoch().count(), .since = line.since};
  [[maybe_unused]] const ssize_t written = ::write(file.number(), &note, sizeof note);
}

}  // namespace spindle::posix
