#include "owning.hpp"

#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <optional>
#include <utility>

#include "watched_tool.hpp"
#include "watching.hpp"

namespace spindle::commands {
namespace {

/// People are told of one tool's link at most so often.
constexpr Duration link_told_every = std::chrono::minutes(1);

struct Address {
  std::string host;
  std::uint16_t port = 0;
};

Error bad_address(const std::string& text) {
  return {.code = Errc::usage,
          .message = fmt::format("'{}' is no address to listen on", text),
          .hint =
              "such as 1502 or 127.0.0.1:1502; other computers reach only what names another "
              "address, such as 0.0.0.0:1502",
          .name = "--listen"};
}

/// "1502", ":1502", "127.0.0.1:1502", "[::1]:1502". What names no address is this computer's alone.
Result<Address> parse_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  std::string host = colon == std::string::npos ? "" : text.substr(0, colon);
  const std::string port = colon == std::string::npos ? text : text.substr(colon + 1);
  const bool is_bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (is_bracketed) host = host.substr(1, host.size() - 2);
  if (!is_bracketed && host.find(':') != std::string::npos) {
    return tl::unexpected(bad_address(text));
  }
  std::uint16_t number = 0;
  const auto [end, failure] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (port.empty() || failure != std::errc() || end != port.data() + port.size()) {
    return tl::unexpected(bad_address(text));
  }
  return Address{host.empty() ? "127.0.0.1" : std::move(host), number};
}

/// Tells what becomes of the link of one tool that is held.
class Holding final : public Listener {
 public:
  Holding(const Target& target, OwnedLines::Note note, const Context& context)
      : target_(target), note_(std::move(note)), context_(&context) {}

  TimePoint until() override { return TimePoint::max(); }
  void opened(const WatchedTool& /*tool*/) override {}
  device::WatchControl tell(const device::WatchEvent& news) override {
    if (const auto* link = std::get_if<device::LinkChange>(&news)) tell_link(*link);
    return device::WatchControl::go_on;
  }
  void left(const Result<void>& watched, const std::optional<Error>& /*unreached*/) override {
    if (!watched && !context_->interrupt.raised()) failure_ = watched.error();
  }
  /// Why it is not held any more.
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }

 private:
  void tell_link(const device::LinkChange& news) {
    const bool is_up = news.state == device::LinkState::connected;
    const TimePoint now = context_->clock.now();
    const bool is_soon = told_at_ && now < *told_at_ + link_told_every;
    if (is_up == is_up_ || (is_soon && !is_up)) return;
    is_up_ = is_up;
    told_at_ = now;
    note_(fmt::format("{}: {}{}", target_.shown, is_up ? "" : "no link: ", news.message));
  }

  Target target_;
  OwnedLines::Note note_;
  const Context* context_;
  std::optional<bool> is_up_ = std::nullopt;
  std::optional<TimePoint> told_at_ = std::nullopt;
  std::optional<Error> failure_ = std::nullopt;
};

}  // namespace

Result<void> let_others_ask(OwnedLines& lines, const GatewayOptions& options,
                            const OwnedLines::Note& note) {
  if (options.listen.empty()) {
    lines.open_doors();
    return {};
  }
  TRY_LET(const auto address, parse_address(options.listen));
  TRY_LET(const auto port, lines.listen(address.host, address.port, options.rights));
  const bool is_six = address.host.find(':') != std::string::npos;
  note(fmt::format("listening on {}{}{}:{}, {}", is_six ? "[" : "", address.host, is_six ? "]" : "",
                   port,
                   options.rights == link::Rights::write ? "writes are let through" : "read-only"));
  return {};
}

Result<Outcome> hold_tools(const ServeOptions& options, Context& context) {
  // A tool that says nothing of itself can be held as well.
  static const std::vector<std::string> any_register = {"@holding:0"};
  ProfileShelf shelf(context.profiles);
  TRY_LET(auto resolved, resolve_targets(options.targets, context));
  const std::vector<Error> faults = take_out_faulty(resolved);
  TRY_LET(auto tools, prepare_tools(resolved, any_register, shelf, context));
  std::vector<Target> targets;
  for (const WatchedTool& tool : tools) targets.push_back(tool.target());
  std::mutex speaking;
  const OwnedLines::Note note = [&](const std::string& sentence) {
    const std::lock_guard lock(speaking);
    context.renderer.note(sentence);
  };
  Outcome outcome;
  for (const Error& fault : faults) {
    outcome.fail(fault);
    TRY(context.renderer.error(fault, context.clock.wall()));
  }
  OwnedLines lines(targets, context, note);
  TRY(let_others_ask(lines, {.listen = options.listen, .rights = options.rights}, note));
  const device::OpenTransport open = lines.opener();
  const auto plan = [](const catalogue::Profile&) -> Result<device::WatchPlan> {
    return device::WatchPlan{.events = device::EventMode::none};
  };
  std::vector<std::unique_ptr<Holding>> held;
  for (const WatchedTool& tool : tools) {
    held.push_back(std::make_unique<Holding>(tool.target(), note, context));
  }
  for_each_side_by_side(tools, [&](WatchedTool& tool) {
    Holding& holding = *held[static_cast<std::size_t>(&tool - tools.data())];
    watch_tool(tool, open, plan, device::Reconnection::whatever, holding, context);
  });
  for (const auto& holding : held) {
    if (!holding->failure()) {
      outcome.succeed();
      continue;
    }
    outcome.fail(*holding->failure());
    TRY(context.renderer.error(*holding->failure(), context.clock.wall()));
  }
  return outcome;
}

}  // namespace spindle::commands
