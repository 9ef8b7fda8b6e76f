#include "device/hints.hpp"

#include <fmt/format.h>

#include "spindle/base/text.hpp"
#include "spindle/catalogue/document_number.hpp"

namespace spindle::device {
namespace {

using link::Medium;

/// What keeps a serial line silent is not what keeps a network silent.
constexpr std::string_view line_hint =
    "check power, wiring and termination, and that rate, parity and stop bits are those of the "
    "device";

/// The same place, spoken to in another way.
std::string url_as(link::Endpoint endpoint, Medium medium, std::uint16_t port) {
  if (!endpoint.port) endpoint.port = port;
  endpoint.medium = medium;
  return link::to_url(endpoint);
}

std::string unit_hint(const Asked& asked) {
  const auto& units = asked.profile.link.units;
  if (units && !units->contains(asked.unit)) {
    return fmt::format("unit {} was asked, and {} can only be {} to {}: give ?unit=N",
                       asked.unit.value, with_article(asked.profile.series), units->first,
                       units->last);
  }
  return fmt::format("unit {} was asked: is that its address? ?unit=N asks another one",
                     asked.unit.value);
}

std::string hint_on_network(const Asked& asked) {
  const std::string rtu = url_as(asked.endpoint, Medium::rtu_over_tcp, asked.profile.link.port);
  if (asked.profile.link.framing == modbus::Framing::rtu) {
    return fmt::format("{}; behind a server that passes RTU on, write {}", unit_hint(asked), rtu);
  }
  // Tools that push events look at no unit and fall asleep; of others nothing is known.
  if (asked.profile.events || !asked.profile.id.empty()) return {};
  return fmt::format(
      "it may be asleep, or another client holds its session; {}; if it speaks RTU "
      "over TCP, write {}",
      unit_hint(asked), rtu);
}

std::string hint_behind_server(const Asked& asked) {
  const std::string tcp = url_as(asked.endpoint, Medium::tcp, asked.profile.link.port);
  if (!asked.profile.id.empty() && asked.profile.link.framing == modbus::Framing::tcp) {
    return fmt::format("{} speaks Modbus TCP: write {}", with_article(asked.profile.series), tcp);
  }
  return fmt::format("{}; {}; if the device speaks Modbus TCP, write {}", unit_hint(asked),
                     line_hint, tcp);
}

}  // namespace

std::string hint_for_silence(const Error& error, const Asked& asked) {
  const bool ended = error.code == Errc::closed || error.code == Errc::reset;
  if (ended && !asked.answered_before && asked.endpoint.medium == Medium::rtu_over_tcp) {
    return fmt::format("does it speak Modbus TCP? then write {}",
                       url_as(asked.endpoint, Medium::tcp, asked.profile.link.port));
  }
  if (error.code != Errc::no_answer || !error.hint.empty()) return {};
  switch (asked.endpoint.medium) {
    case Medium::tcp:
      return asked.answered_before ? std::string() : hint_on_network(asked);
    case Medium::rtu_over_tcp:
      return asked.answered_before ? std::string(line_hint) : hint_behind_server(asked);
    case Medium::simulated:
      if (asked.profile.link.framing == modbus::Framing::tcp) return {};
      break;
    case Medium::serial:
      break;
  }
  if (asked.answered_before) return std::string(line_hint);
  return fmt::format("{}; {}", unit_hint(asked), line_hint);
}

std::string hint_for_absent_register(const Error& error) {
  constexpr auto absent = static_cast<std::uint8_t>(modbus::ExceptionCode::illegal_data_address);
  if (error.exception != absent || !error.register_address) return {};
  return catalogue::hint_for_document_number(*error.register_address);
}

}  // namespace spindle::device
