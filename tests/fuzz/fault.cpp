// Any text as a fault of a simulated tool.

#include "input.hpp"
#include "spindle/sim/fault_plan.hpp"

using namespace spindle;
using spindle::fuzz::require;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text = fuzz::Input(data, size).text();
  const auto fault = sim::parse_fault(text);
  if (!fault) {
    require(fault.error().code == Errc::bad_value);
    return 0;
  }
  require(text.starts_with(sim::to_text(fault->kind)));
  require(fault->at == 0 || fault->every == 0);
  require(fault->at == 0 || (fault->applies_to(fault->at) && !fault->applies_to(fault->at + 1)));
  require(fault->every == 0 || fault->applies_to(fault->every));
  require(!fault->number || sim::number_of(*fault) == *fault->number);
  return 0;
}
