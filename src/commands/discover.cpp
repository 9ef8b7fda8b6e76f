#include "discover.hpp"

#include <fmt/format.h>

#include <utility>

#include "listing.hpp"
#include "progress.hpp"
#include "records.hpp"
#include "spindle/base/duration.hpp"
#include "spindle/base/text.hpp"
#include "spindle/commands/commands.hpp"
#include "spindle/work/change.hpp"
#include "spindle/work/discovery.hpp"
#include "spindle/work/sweep.hpp"

namespace spindle::commands {
namespace {

/// Tells what is found, and remembers what could be added to the tools file.
class Finds {
 public:
  Finds(const DiscoverOptions& options, Context& context)
      : keeps_(options.write == WriteTools::yes),
        context_(&context),
        listing_(context, discovered_columns()) {}

  template <typename Tool>
  void add(const Tool& tool) {
    Discovered found = discovered(tool, *context_);
    listing_.add(found.record);
    if (keeps_) kept_.push_back(std::move(found));
  }

  [[nodiscard]] Listing& listing() { return listing_; }
  [[nodiscard]] const std::vector<Discovered>& kept() const { return kept_; }

 private:
  bool keeps_;
  Context* context_;
  Listing listing_;
  std::vector<Discovered> kept_ = {};
};

/// How it ended, before anything is added to the tools file.
struct Ended {
  std::size_t found = 0;
  std::vector<report::Field> counts = {};
  std::string sentence = {};
  std::string why_none = {};  ///< why nothing may have been found
  std::optional<Error> error = std::nullopt;
};

Ended scan_network(const std::vector<link::NetworkInterface>& interfaces,
                   const DiscoverOptions& options, Finds& finds, Context& context) {
  Ended ended;
  std::size_t strange = 0;
  for (const auto& spec : work::discovery_specs(context.profiles)) {
    const auto scanned = work::scan_group(spec, interfaces, options.duration, context,
                                          [&](const work::Heard& heard) {
                                            ++ended.found;
                                            finds.add(heard);
                                          });
    if (!scanned) {
      ended.error = scanned.error();
      break;
    }
    for (const Error& fault : scanned->faults) {
      context.renderer.note(fmt::format("{}: {}", fault.name, message_of(fault)));
    }
    if (scanned->left_out > 0) {
      context.renderer.note(fmt::format("{} of more tools left out: this may be a flood",
                                        counted(scanned->left_out, "answer")));
    }
    strange += scanned->strange;
  }
  std::vector<std::string> names;
  for (const auto& each : interfaces) names.push_back(each.name);
  const std::string time =
      ended.error ? std::string() : fmt::format(" in {}", to_text(options.duration));
  ended.sentence =
      fmt::format("{} found{} on {}", counted(ended.found, "tool"), time, fmt::join(names, ", "));
  if (strange > 0) {
    ended.sentence += fmt::format("; {} understood", strange == 1 ? "1 datagram was not"
                                                                  : fmt::format("{} datagrams were "
                                                                                "not",
                                                                                strange));
  }
  ended.counts = {
      {"found", count(ended.found)}, {"strange", count(strange)}, {"interfaces", names}};
  ended.why_none =
      "tools may be asleep, in another network than this computer, behind a firewall (UDP), or "
      "behind an access point that keeps its clients apart or passes no multicast on; 'spindle "
      "discover 192.168.10.0/24' tries each address of a network instead";
  return ended;
}

Ended sweep(const Ipv4Network& network, const DiscoverOptions& options, Finds& finds,
            Context& context) {
  const work::SweepPlan plan{
      .network = network, .ports = options.ports, .units = options.units, .rate = options.rate};
  ProgressLine progress(context);
  const work::SweepResult swept = work::sweep_network(
      plan, context, [&](const work::SweptTool& tool) { finds.add(tool); },
      progress.counter("addresses asked"));
  Ended ended{.found = swept.found, .error = swept.error};
  ended.counts = {{"found", count(swept.found)},
                  {"asked", count(swept.asked)},
                  {"addresses", count(swept.addresses)},
                  {"open", count(swept.open)}};
  ended.sentence = fmt::format("{} {} asked, {} found", swept.asked,
                               swept.asked == 1 ? "address" : "addresses", swept.found);
  if (swept.open > 0) {
    ended.sentence += fmt::format("; {} that {} no Modbus", counted(swept.open, "open port"),
                                  swept.open == 1 ? "speaks" : "speak");
  }
  if (swept.asked < swept.addresses) {
    ended.sentence += fmt::format("; {} not asked", swept.addresses - swept.asked);
  }
  ended.why_none =
      "tools may be asleep, in another network, behind a firewall, or held by another program "
      "that lets no second one connect";
  return ended;
}

/// Tells how it ended, and adds what was found to the tools file where that is wanted.
Result<Outcome> conclude(Ended ended, const DiscoverOptions& options, Finds& finds,
                         Context& context) {
  Outcome outcome;
  if (ended.error) {
    outcome.fail(*ended.error);
    ended.sentence += "; it ended early";
    if (!work::is_interruption(*ended.error)) finds.listing().add(*ended.error);
  } else if (ended.found == 0) {
    outcome.negate();
    ended.sentence += ": " + ended.why_none;
  } else {
    outcome.succeed();
  }
  if (options.write == WriteTools::yes && outcome.succeeded() > 0) {
    TRY(finds.listing().end());
    TRY_LET(const auto added, add_to_tools_file(finds.kept(), context));
    ended.counts.push_back({"added", added});
    if (!added.empty()) ended.sentence += fmt::format("; {} added", added.size());
    return tell({.counts = std::move(ended.counts), .sentence = std::move(ended.sentence)}, outcome,
                context)
        .map([&] { return outcome; });
  }
  return finish(finds.listing(), outcome,
                {.counts = std::move(ended.counts), .sentence = std::move(ended.sentence)},
                context);
}

}  // namespace

Result<Outcome> discover(const DiscoverOptions& options, Context& context) {
  if (!options.subnet.empty()) {
    TRY_LET(const auto network, work::parse_sweep(options.subnet));
    Finds finds(options, context);
    return conclude(sweep(network, options, finds, context), options, finds, context);
  }
  TRY_LET(const auto interfaces, work::choose_interfaces(options.interfaces, context.network));
  Finds finds(options, context);
  return conclude(scan_network(interfaces, options, finds, context), options, finds, context);
}

}  // namespace spindle::commands
