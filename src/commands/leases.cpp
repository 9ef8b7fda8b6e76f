#include "leases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "spindle/base/text.hpp"

namespace spindle::commands {
namespace {

constexpr Duration first_retry = std::chrono::milliseconds(500);
constexpr Duration last_retry = std::chrono::seconds(10);
constexpr std::uint64_t largest_fence = 0x7FFF'FFFF'FFFF'FFFF;

constexpr std::string_view renewal = "hold";

/// Renewals of one lease: a few may fail before it ends.
constexpr int renewals = 10;

/// The part of a lease in which a tool is left, so that it is disarmed before the lease ends.
Duration farewell_of(Duration ttl) { return ttl * 2 / 5; }

/// The last event of a tool is asked for while it is connected, which does not wait for long.
constexpr Duration last_limit = std::chrono::seconds(2);

}  // namespace

Leases::Leases(Start start, Duration ttl, Clock& clock, const Interrupt& interrupt, Note note)
    : start_(std::move(start)),
      ttl_(ttl),
      clock_(&clock),
      interrupt_(&interrupt),
      note_(std::move(note)),
      retry_(first_retry) {
  thread_ = std::thread([this] { run(); });
}

Leases::~Leases() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

void Leases::want(std::set<std::string> names) {
  const std::lock_guard lock(mutex_);
  wanted_ = std::move(names);
}

std::set<std::string> Leases::held() const {
  const std::lock_guard lock(mutex_);
  std::set<std::string> names;
  const TimePoint now = clock_->now();
  for (const auto& [name, held] : held_) {
    if (now < held.until) names.insert(name);
  }
  return names;
}

std::optional<std::int64_t> Leases::fence(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = held_.find(name);
  if (found == held_.end() || clock_->now() >= found->second.until) return std::nullopt;
  return found->second.fence;
}

/// Until the end, or a signal: what is held then is given back once it was left.
void Leases::run() {
  while (!interrupt_->raised()) {
    renew();
    if (wait(ttl_ / renewals)) return;
  }
}

/// Whether it is to end.
bool Leases::wait(Duration time) {
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, time, [this] { return closing_ || interrupt_->raised(); });
}

void Leases::renew() {
  std::vector<std::string> words = {
      fmt::format("{}", std::chrono::ceil<std::chrono::milliseconds>(ttl_).count())};
  {
    const std::lock_guard lock(mutex_);
    words.insert(words.end(), wanted_.begin(), wanted_.end());
  }
  if (words.size() == 1) return;
  const TimePoint asked = clock_->now();
  auto answer = ask(std::string(renewal), std::move(words), asked + ttl_);
  if (interrupt_->raised()) return;
  if (!answer) return tell(describe(answer.error()));
  if (answer->verb != "held") {
    return tell(answer->words.empty() ? "the database cannot be asked" : answer->words.front());
  }
  take(*answer, asked + ttl_ - farewell_of(ttl_));
  if (!std::exchange(told_, {}).empty()) note_("leases are renewed again");
}

/// What the database does not say any more is lost.
void Leases::take(const work::LeaseLine& answer, TimePoint until) {
  std::map<std::string, Held> held;
  for (std::size_t at = 0; at + 1 < answer.words.size(); at += 2) {
    const auto fence = parse_unsigned(answer.words[at + 1], largest_fence);
    if (fence) {
      held[answer.words[at]] = {.fence = static_cast<std::int64_t>(*fence), .until = until};
    }
  }
  const std::lock_guard lock(mutex_);
  held_ = std::move(held);
}

/// The same trouble is told once.
void Leases::tell(const std::string& text) {
  if (std::exchange(told_, text) == text) return;
  note_(fmt::format("leases cannot be renewed: {}", text));
}

Result<void> Leases::open() {
  if (channel_) return {};
  if (clock_->now() < retry_at_) {
    return tl::unexpected(
        Error{.code = Errc::closed, .message = "the helper program is started again soon"});
  }
  auto started = start_();
  retry_at_ = clock_->now() + retry_;
  retry_ = std::min(2 * retry_, last_retry);
  if (!started) return tl::unexpected(std::move(started.error()));
  channel_ = std::move(*started);
  return {};
}

/// A program that does not answer in time is started anew.
Result<work::LeaseLine> Leases::ask(const std::string& verb, std::vector<std::string> words,
                                    TimePoint deadline) {
  const std::lock_guard lock(channel_mutex_);
  TRY(open());
  const std::uint64_t id = ++questions_;
  const auto failed = [&](Error error) {
    channel_.reset();
    return tl::unexpected(std::move(error));
  };
  auto sent = channel_->send(work::to_line({verb, id, std::move(words)}));
  if (!sent) return failed(std::move(sent.error()));
  for (;;) {
    auto line = channel_->receive(deadline);
    if (!line && interrupt_->raised()) return tl::unexpected(std::move(line.error()));
    if (!line) return failed(std::move(line.error()));
    if (!*line) {
      Error silent{.code = Errc::no_answer, .message = "the helper program does not answer"};
      // It may be about to connect; only renewals say that it hangs.
      if (verb != renewal) return tl::unexpected(std::move(silent));
      return failed(std::move(silent));
    }
    auto answer = work::lease_line_of(**line);
    // Late answers are to nothing that is still asked.
    if (!answer || answer->id != id) continue;
    retry_ = first_retry;
    return std::move(*answer);
  }
}

Result<std::optional<store::Last>> Leases::last(const store::ToolName& name) {
  const auto unknown = [](const std::string& why) {
    return tl::unexpected(Error{
        .code = Errc::storage,
        .message = fmt::format("what the tool told other collectors last is not known: {}", why)});
  };
  auto answer = ask("last", {name.maker, name.serial}, clock_->now() + last_limit);
  if (!answer) return unknown(message_of(answer.error()));
  if (answer->verb == "nothing") return std::optional<store::Last>();
  auto last = answer->verb == "told" ? work::last_of(answer->words) : std::nullopt;
  if (!last) return unknown(answer->words.empty() ? "no answer" : answer->words.front());
  return last;
}

void Leases::give_back() {
  std::vector<std::string> names;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [name, held] : held_) names.push_back(name);
    held_.clear();
    wanted_.clear();
  }
  const std::lock_guard lock(channel_mutex_);
  if (!channel_ || names.empty()) return;
  // Not waited for: what does not arrive ends with its time.
  [[maybe_unused]] const auto sent =
      channel_->send(work::to_line({"release", ++questions_, std::move(names)}));
}

}  // namespace spindle::commands
