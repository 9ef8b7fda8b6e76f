#include "spindle/posix/helper.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include "posix/descriptor.hpp"
#include "posix/wait.hpp"
#include "spindle/posix/companion.hpp"

namespace spindle::posix {
namespace {

/// For a helper that ends because its channel was closed.
constexpr Duration farewell = std::chrono::seconds(3);

Error gone() {
  return {.code = Errc::closed,
          .message = "the helper program has ended",
          .hint = "it is started again; what it said before tells why"};
}

class Helper final : public LineChannel {
 public:
  Helper(Descriptor channel, pid_t process, Clock& clock, const Interrupt& interrupt)
      : channel_(std::move(channel)), process_(process), clock_(&clock), interrupt_(&interrupt) {}
  ~Helper() override;

  Result<void> send(std::string_view line) override;
  Result<std::optional<std::string>> receive(TimePoint deadline) override;

 private:
  std::optional<std::string> take_line();

  Descriptor channel_;
  pid_t process_;
  Clock* clock_;
  const Interrupt* interrupt_;
  std::string heard_ = {};
};

Helper::~Helper() {
  ::shutdown(channel_.number(), SHUT_WR);
  const TimePoint deadline = clock_->now() + farewell;
  std::array<char, 1024> last = {};
  const Interrupt none;
  while (wait_for({channel_.number(), POLLIN}, deadline, *clock_, none) == Woken::ready) {
    if (::recv(channel_.number(), last.data(), last.size(), 0) <= 0) break;
  }
  ::kill(process_, SIGKILL);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

/// What is sent is short: a helper that does not even take that hangs.
Result<void> Helper::send(std::string_view line) {
  const std::string whole = std::string(line) + "\n";
  const ssize_t sent =
      ::send(channel_.number(), whole.data(), whole.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  if (sent == static_cast<ssize_t>(whole.size())) return {};
  return tl::unexpected(gone());
}

std::optional<std::string> Helper::take_line() {
  const std::size_t end = heard_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = heard_.substr(0, end);
  heard_.erase(0, end + 1);
  return line;
}

Result<std::optional<std::string>> Helper::receive(TimePoint deadline) {
  for (;;) {
    if (auto line = take_line()) return line;
    switch (wait_for({channel_.number(), POLLIN}, deadline, *clock_, *interrupt_)) {
      case Woken::interrupted:
        return tl::unexpected(interrupt_->error());
      case Woken::deadline:
        return std::optional<std::string>();
      case Woken::ready:
        break;
    }
    std::array<char, 4096> chunk = {};
    const ssize_t got = ::recv(channel_.number(), chunk.data(), chunk.size(), MSG_DONTWAIT);
    if (got > 0) {
      heard_.append(chunk.data(), static_cast<std::size_t>(got));
    } else if (got == 0 || (errno != EINTR && errno != EAGAIN)) {
      return tl::unexpected(gone());
    }
  }
}

/// In a group of its own: what a terminal sends to all of ours does not end it first.
int spawn(std::vector<std::string> words, int channel, pid_t& process) {
  std::vector<char*> raw;
  for (std::string& word : words) raw.push_back(word.data());
  raw.push_back(nullptr);
  posix_spawn_file_actions_t files = {};
  posix_spawnattr_t how = {};
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawnattr_init(&how);
  ::posix_spawn_file_actions_adddup2(&files, channel, STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&files, channel, STDOUT_FILENO);
  sigset_t none = {};
  ::sigemptyset(&none);
  ::posix_spawnattr_setsigmask(&how, &none);
  ::posix_spawnattr_setflags(&how, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  const int failure = ::posix_spawn(&process, raw.front(), &files, &how, raw.data(), ::environ);
  ::posix_spawnattr_destroy(&how);
  ::posix_spawn_file_actions_destroy(&files);
  return failure;
}

}  // namespace

Result<std::unique_ptr<LineChannel>> start_helper(std::string_view program,
                                                  const std::vector<std::string>& arguments,
                                                  Clock& clock, const Interrupt& interrupt) {
  std::array<int, 2> ends = {-1, -1};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return tl::unexpected(Error{.code = Errc::internal,
                                .message = fmt::format("no channel to another program: {}",
                                                       std::generic_category().message(errno))});
  }
  Descriptor ours(ends[0]);
  const Descriptor theirs(ends[1]);
  int failure = ENOENT;
  for (const std::string& path : companion_places(program)) {
    std::vector<std::string> words = {path};
    words.insert(words.end(), arguments.begin(), arguments.end());
    pid_t process = 0;
    const int failed = spawn(std::move(words), theirs.number(), process);
    if (failed == 0) return std::make_unique<Helper>(std::move(ours), process, clock, interrupt);
    if (failed != ENOENT) failure = failed;
  }
  return tl::unexpected(no_companion(program, failure));
}

}  // namespace spindle::posix
