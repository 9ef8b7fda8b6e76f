#include "spindle/work/block_search.hpp"

#include <algorithm>
#include <memory>
#include <utility>
#include <variant>

#include "spindle/catalogue/event_layout.hpp"
#include "spindle/device/event_source.hpp"
#include "spindle/work/register_survey.hpp"

namespace spindle::work {
namespace {

using modbus::ExceptionCode;

// How often another event is waited for where several places hold the last one.
constexpr int most_rounds = 3;

// How often a busy tool is asked again, and the time between.
constexpr int most_repetitions = 20;
constexpr Duration busy_pause = std::chrono::milliseconds(100);

// How often a place is read again because an event came meanwhile, by how many events a place may
// be ahead of what was heard, and how long their frames may take.
constexpr int most_readings = 3;
constexpr std::uint16_t most_ahead = 3;
constexpr Duration frame_comes_within = std::chrono::seconds(1);

bool is_one_of(const Error& error, std::initializer_list<ExceptionCode> codes) {
  return std::any_of(codes.begin(), codes.end(), [&](ExceptionCode code) {
    return error.exception == static_cast<std::uint8_t>(code);
  });
}

bool is_refusal(const Error& error) {
  using enum ExceptionCode;
  return is_one_of(error, {illegal_data_address, illegal_data_value, server_device_failure});
}

bool is_busy(const Error& error) {
  using enum ExceptionCode;
  return is_one_of(error, {acknowledge, server_device_busy});
}

/// Hears the tool's events from its beginning to its end.
class EventEar {
 public:
  EventEar(OpenTool& tool, Clock& clock)
      : tool_(&tool),
        clock_(&clock),
        source_(device::EventSource::make(tool.device.profile(), device::EventMode::declared, clock,
                                          [this](const auto& news) { take(news); })) {}
  EventEar(const EventEar&) = delete;
  EventEar& operator=(const EventEar&) = delete;
  ~EventEar() { source_->disarm(); }

  Result<void> begin() {
    keep_alive_due_ = clock_->now();
    return source_->attach(tool_->device, Duration::zero());
  }

  /// The last event that was pushed; empty: there was none yet.
  [[nodiscard]] const std::optional<Registers>& last() const { return last_; }
  [[nodiscard]] std::size_t count() const { return count_; }

  /// Waits until more than `count` events came. Whether they did before the deadline.
  Result<bool> wait_for_more(std::size_t count, TimePoint deadline) {
    while (count_ <= count && clock_->now() < deadline) {
      const TimePoint until = std::min({deadline, source_->next_due(), keep_alive_due_});
      TRY_LET(const auto frame, tool_->device.session().next_spontaneous(until));
      if (frame) source_->handle(*frame);
      TRY(keep_armed());
    }
    return count_ > count;
  }

  /// Reads while events are heard.
  Result<Registers> read(const link::RegisterRange& range) {
    TRY(keep_armed());
    Result<Registers> read;
    const auto heard = ask([&]() -> Result<void> {
      read = tool_->device.read_block(range);
      return {};
    });
    if (!heard) return tl::unexpected(heard.error());
    return read;
  }

 private:
  void take(const device::EventSource::News& news) {
    const auto* event = std::get_if<device::ToolEvent>(&news);
    // What was read is what is looked for.
    if (event == nullptr || event->source != device::EventOrigin::push) return;
    if (event->block.size() != tool_->device.profile().events->count) return;
    last_ = event->block;
    ++count_;
  }

  Result<void> ask(const std::function<Result<void>()>& request) {
    source_->handle_waiting();
    link::Session& session = tool_->device.session();
    session.on_spontaneous([this](const link::Spontaneous& frame) { source_->handle(frame); });
    auto answered = request();
    session.on_spontaneous({});
    return answered;
  }

  Result<void> keep_armed() {
    TRY(source_->run_due([this](const auto& request) { return ask(request); }));
    const Duration every = tool_->device.profile().link.keep_alive;
    if (every <= Duration::zero() || clock_->now() < keep_alive_due_) return {};
    keep_alive_due_ = clock_->now() + every;
    return ask([this] { return tool_->device.ping().map([](Duration) {}); });
  }

  OpenTool* tool_;
  Clock* clock_;
  std::unique_ptr<device::EventSource> source_;
  TimePoint keep_alive_due_ = {};
  std::optional<Registers> last_ = std::nullopt;
  std::size_t count_ = 0;
};

/// One search, with its tool and what it hears.
class BlockHunt {
 public:
  BlockHunt(OpenTool& tool, Clock& clock)
      : events_(&*tool.device.profile().events),
        search_(&*events_->search),
        table_(catalogue::table_of(*events_)),
        layout_(tool.device.profile()),
        clock_(&clock),
        ear_(tool, clock) {}

  Result<BlockSearchResult> run(Duration patience,
                                const std::function<void(const BlockSearchNews&)>& tell,
                                const link::Progress& progress) {
    TRY(ear_.begin());
    if (!ear_.last()) tell({});
    TRY_LET(const bool came, ear_.wait_for_more(0, clock_->now() + patience));
    if (!came) return std::move(result_);
    tell({BlockSearchNews::Kind::event, number()});
    TRY(look_everywhere(progress));
    TRY(confirm());
    for (int round = 0; round < most_rounds && result_.places.size() > 1; ++round) {
      tell({BlockSearchNews::Kind::again, number(), result_.places.size()});
      TRY_LET(const bool more, ear_.wait_for_more(ear_.count(), clock_->now() + patience));
      if (!more) break;
      TRY(confirm());
    }
    result_.number = number();
    return std::move(result_);
  }

 private:
  enum class Match : std::uint8_t { none, similar, same };

  [[nodiscard]] std::uint16_t number() const { return layout_.number_of(*ear_.last()); }

  Result<void> look_everywhere(const link::Progress& progress) {
    const std::size_t places = (std::size_t{search_->to} - search_->from) / search_->step + 1;
    for (std::size_t at = 0; at < places; ++at) {
      if (progress) progress(at, places);
      if (at > 0) TRY(clock_->sleep_until(clock_->now() + usual_pause));
      const auto first = static_cast<std::uint16_t>(search_->from + at * search_->step);
      ++result_.asked;
      TRY_LET(const Match match, look_at(first));
      if (match == Match::same) result_.places.push_back(first);
      if (match == Match::similar) result_.similar.push_back(first);
    }
    return {};
  }

  /// Those that hold the last event now.
  Result<void> confirm() {
    std::vector<std::uint16_t> confirmed;
    for (const std::uint16_t first : std::exchange(result_.places, {})) {
      TRY_LET(const Match match, look_at(first));
      if (match == Match::same) confirmed.push_back(first);
    }
    result_.places = std::move(confirmed);
    return {};
  }

  /// An event that comes while its block is read makes the reading worth nothing.
  Result<Match> look_at(std::uint16_t first) {
    for (int reading = 0;; ++reading) {
      const std::size_t before = ear_.count();
      TRY_LET(const auto block, read_place(first));
      if (!block) return Match::none;
      if (reading == 0) ++result_.answered;
      if (*block == *ear_.last()) return Match::same;
      if (reading < most_readings) {
        if (ear_.count() != before) continue;
        // It may hold an event whose frame is still under way.
        const auto ahead = static_cast<std::uint16_t>(layout_.number_of(*block) - number());
        if (ahead > 0 && ahead <= most_ahead) {
          TRY_LET(const bool more, ear_.wait_for_more(before, clock_->now() + frame_comes_within));
          if (more) continue;
        }
      }
      return layout_.key_of(*block) == layout_.key_of(*ear_.last()) ? Match::similar : Match::none;
    }
  }

  /// More registers than the block has, so that the answer is not like an event; in two parts where
  /// the tool shows no more than the block. Empty: it does not show them.
  Result<std::optional<Registers>> read_place(std::uint16_t first) {
    const std::uint16_t size = events_->count;
    TRY_LET(auto whole, read_shown({table_, first, search_->count}));
    if (whole) {
      whole->resize(size);
      return whole;
    }
    const auto head_size = static_cast<std::uint16_t>(size / 2);
    TRY_LET(auto head, read_shown({table_, first, head_size}));
    if (!head) return std::nullopt;
    TRY_LET(const auto rest, read_shown({table_, static_cast<std::uint16_t>(first + head_size),
                                         static_cast<std::uint16_t>(size - head_size)}));
    if (!rest) return std::nullopt;
    head->insert(head->end(), rest->begin(), rest->end());
    return head;
  }

  /// Empty: the tool refuses them.
  Result<std::optional<Registers>> read_shown(const link::RegisterRange& range) {
    for (int repetition = 0;; ++repetition) {
      auto registers = ear_.read(range);
      if (registers) return std::move(*registers);
      if (is_refusal(registers.error())) return std::nullopt;
      if (!is_busy(registers.error()) || repetition == most_repetitions) {
        return tl::unexpected(std::move(registers.error()));
      }
      TRY(clock_->sleep_until(clock_->now() + busy_pause));
    }
  }

  const catalogue::EventSpec* events_;
  const catalogue::BlockSearch* search_;
  modbus::RegisterTable table_;
  catalogue::EventLayout layout_;
  Clock* clock_;
  EventEar ear_;
  BlockSearchResult result_ = {};
};

}  // namespace

Result<BlockSearchResult> search_block(OpenTool& tool, Duration patience, Clock& clock,
                                       const std::function<void(const BlockSearchNews&)>& tell,
                                       const link::Progress& progress) {
  return BlockHunt(tool, clock).run(patience, tell, progress);
}

}  // namespace spindle::work
