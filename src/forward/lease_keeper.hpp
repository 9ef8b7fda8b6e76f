#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "postgres_address.hpp"
#include "postgres_connection.hpp"
#include "spindle/work/lease_lines.hpp"

namespace spindle::forward {

/// Leases of tools in the table spindle_lease, for one collector. Only the server's clock counts
/// there. Each answer is about what was asked with it: nothing is renewed by itself, so that the
/// leases of a recorder that stands still end. One thread.
class LeaseKeeper {
 public:
  /// `holder` names the collector; no two may have one name. All outlive it.
  LeaseKeeper(std::vector<PostgresAddress> addresses, std::string holder, Clock& clock,
              const Interrupt& interrupt)
      : addresses_(std::move(addresses)),
        holder_(std::move(holder)),
        clock_(&clock),
        interrupt_(&interrupt) {}

  /// The answer to one question.
  work::LeaseLine answer(const work::LeaseLine& question);

 private:
  using Rows = tl::expected<PostgresRows, PostgresRefusal>;

  Result<work::LeaseLine> hold(const work::LeaseLine& question);
  Result<work::LeaseLine> last(const work::LeaseLine& question);
  Result<work::LeaseLine> release(const work::LeaseLine& question);
  Result<void> connect();
  Result<PostgresRows> ask(const char* statement, const PostgresValues& values);
  Result<std::vector<std::string>> renew_and_take(const std::string& tools, std::size_t count,
                                                  const std::string& ttl);
  [[nodiscard]] std::size_t most_to_take(const PostgresRows& standing, std::size_t count) const;

  std::vector<PostgresAddress> addresses_;
  std::string holder_;
  Clock* clock_;
  const Interrupt* interrupt_;
  Duration limit_ = std::chrono::seconds(4);
  std::size_t next_ = 0;  ///< address
  std::optional<PostgresConnection> connection_ = std::nullopt;
  std::optional<TimePoint> first_held_ = std::nullopt;  ///< when it was first asked to hold
};

/// Answers the questions that stand on standard input, until it ends or a signal comes.
Result<void> keep_leases(LeaseKeeper& keeper, const Interrupt& interrupt,
                         const std::function<Result<void>(std::string_view)>& out);

}  // namespace spindle::forward
