#include "lease_keeper.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "postgres_batch.hpp"
#include "spindle/base/text.hpp"

namespace spindle::forward {
namespace {

// A collector says with a row of its own that it lives, under the tools that it wants: those that
// want the same ones divide them. No tool's name begins with '@'. What no row names yet is free.
constexpr const char* make_rows = R"(
INSERT INTO spindle_lease (tool, holder, fence, expires)
SELECT tool, '', 0, clock_timestamp()
FROM unnest($1::text[] || ('@' || md5($1::text[]::text) || '/' || $2)) AS tool
ON CONFLICT DO NOTHING)";

// What expired is not renewed: it has to be taken anew, under another number.
constexpr const char* renew_rows = R"(
UPDATE spindle_lease SET expires = clock_timestamp() + $3::interval
WHERE holder = $2 AND expires > clock_timestamp() AND tool = ANY ($1::text[]))";

constexpr const char* renew_presence = R"(
UPDATE spindle_lease SET holder = $2, expires = clock_timestamp() + $3::interval,
  fence = fence + (CASE WHEN expires > clock_timestamp() THEN 0 ELSE 1 END)
WHERE tool = '@' || md5($1::text[]::text) || '/' || $2)";

// How many collectors want these tools, how many of them are held here, and how many are free and
// since long: those are left over by collectors that have their share.
constexpr const char* count_rows = R"(
SELECT
  count(*) FILTER (WHERE tool LIKE '@%' AND expires > clock_timestamp()),
  count(*) FILTER (WHERE tool NOT LIKE '@%' AND holder = $2 AND expires > clock_timestamp()),
  count(*) FILTER (WHERE tool NOT LIKE '@%' AND expires <= clock_timestamp() - $3::interval / 10)
FROM spindle_lease
WHERE tool = ANY ($1::text[]) OR tool LIKE '@' || md5($1::text[]::text) || '/%')";

// What another collector takes at this moment is skipped.
constexpr const char* take_rows = R"(
UPDATE spindle_lease AS lease
SET holder = $2, fence = lease.fence + 1, expires = clock_timestamp() + $3::interval
FROM (SELECT tool FROM spindle_lease
      WHERE tool = ANY ($1::text[]) AND expires <= clock_timestamp()
      ORDER BY expires, tool LIMIT $4::bigint FOR UPDATE SKIP LOCKED) AS free
WHERE lease.tool = free.tool AND lease.expires <= clock_timestamp())";

constexpr const char* ask_held = R"(
SELECT tool, fence FROM spindle_lease
WHERE tool = ANY ($1::text[]) AND holder = $2 AND expires > clock_timestamp() ORDER BY tool)";

constexpr const char* free_rows = R"(
UPDATE spindle_lease SET expires = clock_timestamp()
WHERE holder = $2 AND expires > clock_timestamp() AND tool = ANY ($1::text[]))";

constexpr const char* ask_last = R"(
(SELECT epoch, number, (extract(epoch FROM at) * 1000)::bigint, encode(raw, 'hex')
 FROM spindle_event WHERE maker = $1 AND serial = $2 ORDER BY epoch DESC, number DESC LIMIT 1)
UNION ALL
(SELECT epoch, before - 1, (extract(epoch FROM ended) * 1000)::bigint, NULL
 FROM spindle_gap WHERE maker = $1 AND serial = $2 AND before > 0
 ORDER BY epoch DESC, before DESC LIMIT 1)
ORDER BY 1 DESC, 2 DESC, 4 NULLS LAST LIMIT 1)";

/// So long a collector that just began takes nothing: others that begin with it are to have their
/// share.
constexpr Duration settling = std::chrono::seconds(2);

std::string array_of(const std::vector<std::string>& words, std::size_t first) {
  PostgresArray array;
  for (std::size_t at = first; at < words.size(); ++at) array.add(words[at]);
  return std::move(array).take();
}

std::size_t number_in(const PostgresRows& rows, int column) {
  constexpr std::uint64_t largest = 1'000'000'000;
  return static_cast<std::size_t>(
      parse_unsigned(rows.text(0, column).value_or("0"), largest).value_or(0));
}

/// A line that came completely, taken off the front.
std::optional<std::string> take_line(std::string& heard) {
  const std::size_t end = heard.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string line = heard.substr(0, end);
  heard.erase(0, end + 1);
  return line;
}

}  // namespace

work::LeaseLine LeaseKeeper::answer(const work::LeaseLine& question) {
  Result<work::LeaseLine> answered =
      tl::unexpected(Error{.code = Errc::internal, .message = "this question is not known"});
  if (question.verb == "hold") answered = hold(question);
  if (question.verb == "last") answered = last(question);
  if (question.verb == "release") answered = release(question);
  if (answered) return std::move(*answered);
  return {.verb = "failed", .id = question.id, .words = {describe(answered.error())}};
}

Result<void> LeaseKeeper::connect() {
  if (connection_) return {};
  std::optional<Error> failure;
  for (std::size_t tried = 0; tried < addresses_.size(); ++tried) {
    const PostgresAddress& address = addresses_[next_ % addresses_.size()];
    auto opened = PostgresConnection::open(address, limit_, *clock_, *interrupt_);
    if (opened) {
      connection_.emplace(std::move(*opened));
      return {};
    }
    ++next_;
    failure = std::move(opened.error());
    if (interrupt_->raised()) break;
  }
  return tl::unexpected(failure.value_or(Error{.code = Errc::usage, .message = "no URL is given"}));
}

/// What failed may have left the session in the middle of an answer or of a transaction.
Result<PostgresRows> LeaseKeeper::ask(const char* statement, const PostgresValues& values) {
  TRY(connect());
  auto rows = connection_->ask(statement, values, clock_->now() + limit_);
  if (rows) return std::move(*rows);
  connection_.reset();
  return tl::unexpected(std::move(rows.error().error));
}

Result<work::LeaseLine> LeaseKeeper::hold(const work::LeaseLine& question) {
  constexpr std::uint64_t longest_ms = 3'600'000;
  const auto ttl =
      question.words.empty() ? std::nullopt : parse_unsigned(question.words.front(), longest_ms);
  if (!ttl || *ttl == 0) {
    return tl::unexpected(Error{.code = Errc::internal, .message = "a lease has no time"});
  }
  limit_ = std::chrono::milliseconds(*ttl) * 4 / 5;
  if (!first_held_) first_held_ = clock_->now();
  const std::size_t count = question.words.size() - 1;
  TRY_LET(auto held,
          renew_and_take(array_of(question.words, 1), count, fmt::format("{} milliseconds", *ttl)));
  return work::LeaseLine{.verb = "held", .id = question.id, .words = std::move(held)};
}

Result<std::vector<std::string>> LeaseKeeper::renew_and_take(const std::string& tools,
                                                             std::size_t count,
                                                             const std::string& ttl) {
  TRY(ask(renew_rows, {tools, holder_, ttl}));
  TRY(ask(make_rows, {tools, holder_}));
  TRY(ask(renew_presence, {tools, holder_, ttl}));
  TRY_LET(const auto standing, ask(count_rows, {tools, holder_, ttl}));
  const std::size_t most = most_to_take(standing, count);
  if (most > 0) TRY(ask(take_rows, {tools, holder_, ttl, fmt::format("{}", most)}));
  TRY_LET(const auto rows, ask(ask_held, {tools, holder_}));
  std::vector<std::string> held;
  for (int row = 0; row < rows.size(); ++row) {
    held.push_back(rows.text(row, 0).value_or(""));
    held.push_back(rows.text(row, 1).value_or("0"));
  }
  return held;
}

/// A fair share of all, and what others leave over.
std::size_t LeaseKeeper::most_to_take(const PostgresRows& standing, std::size_t count) const {
  if (clock_->now() < *first_held_ + settling) return 0;
  const std::size_t collectors = std::max<std::size_t>(1, number_in(standing, 0));
  const std::size_t held = number_in(standing, 1);
  const std::size_t left_over = number_in(standing, 2);
  const std::size_t share = (count + collectors - 1) / collectors;
  return std::max(share > held ? share - held : 0, (left_over + collectors - 1) / collectors);
}

Result<work::LeaseLine> LeaseKeeper::last(const work::LeaseLine& question) {
  if (question.words.size() != 2) {
    return tl::unexpected(Error{.code = Errc::internal, .message = "a tool has no name"});
  }
  TRY_LET(const auto rows,
          ask(ask_last, {clean_text(question.words[0]).text, clean_text(question.words[1]).text}));
  if (rows.size() == 0) return work::LeaseLine{.verb = "nothing", .id = question.id};
  std::vector<std::string> words;
  for (int column = 0; column < 4; ++column) words.push_back(rows.text(0, column).value_or("-"));
  return work::LeaseLine{.verb = "told", .id = question.id, .words = std::move(words)};
}

Result<work::LeaseLine> LeaseKeeper::release(const work::LeaseLine& question) {
  TRY(ask(free_rows, {array_of(question.words, 0), holder_}));
  return work::LeaseLine{.verb = "nothing", .id = question.id};
}

Result<void> keep_leases(LeaseKeeper& keeper, const Interrupt& interrupt,
                         const std::function<Result<void>(std::string_view)>& out) {
  constexpr int no_limit = -1;
  std::string heard;
  while (!interrupt.raised()) {
    while (const auto line = take_line(heard)) {
      const auto question = work::lease_line_of(*line);
      if (!question) continue;
      TRY(out(work::to_line(keeper.answer(*question)) + "\n"));
    }
    std::array<pollfd, 2> waited = {
        pollfd{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0},
        pollfd{.fd = interrupt.descriptor(), .events = POLLIN, .revents = 0}};
    ::poll(waited.data(), waited.size(), no_limit);
    if (interrupt.raised() || waited[0].revents == 0) continue;
    std::array<char, 4096> chunk = {};
    const ssize_t got = ::read(STDIN_FILENO, chunk.data(), chunk.size());
    if (got == 0 || (got < 0 && errno != EINTR)) return {};
    if (got > 0) heard.append(chunk.data(), static_cast<std::size_t>(got));
  }
  return {};
}

}  // namespace spindle::forward
