#include "spindle/link/demux.hpp"

#include <algorithm>

namespace spindle::link {
namespace {

bool is_spontaneous(const modbus::Pdu& pdu, const DemuxRules& rules) {
  return std::any_of(rules.spontaneous.begin(), rules.spontaneous.end(),
                     [&](const SpontaneousShape& shape) { return has_shape(pdu, shape); });
}

bool is_addressed(const modbus::Adu& outstanding, const modbus::Adu& received,
                  const DemuxRules& rules) {
  return has_ids(rules) ? outstanding.transaction == received.transaction
                        : outstanding.unit == received.unit;
}

/// Whether an answer of this unit counts where the transaction id fits.
bool is_unit_taken(const modbus::Adu& outstanding, const modbus::Adu& received,
                   const DemuxRules& rules) {
  if (!has_ids(rules) || outstanding.unit == received.unit) return true;
  const bool identifies =
      outstanding.pdu.function == static_cast<std::uint8_t>(modbus::FunctionCode::report_server_id);
  return rules.units == Units::any || (rules.units == Units::identified && identifies);
}

}  // namespace

bool has_shape(const modbus::Pdu& pdu, const SpontaneousShape& shape) {
  if (pdu.function != shape.function) return false;
  if (shape.is_long()) return true;
  return !pdu.data.empty() && pdu.data.front() == shape.byte_count &&
         pdu.data.size() == std::size_t{1} + shape.byte_count;
}

bool has_ids(const DemuxRules& rules) {
  return rules.framing == modbus::Framing::tcp &&
         rules.transactions == modbus::TransactionIds::echoed;
}

Verdict judge(const modbus::Adu* outstanding, const modbus::Adu& received,
              const DemuxRules& rules) {
  using modbus::Fit;
  const bool addressed = outstanding != nullptr && is_addressed(*outstanding, received, rules);
  const Fit fit = addressed ? modbus::fit(outstanding->pdu, received.pdu) : Fit::foreign;
  const bool answers = fit == Fit::answer || fit == Fit::exception_response;
  if (answers && !is_unit_taken(*outstanding, received, rules)) return Verdict::other_unit;
  if (fit == Fit::answer) return Verdict::answer;
  if (fit == Fit::exception_response) return Verdict::exception_response;
  if (is_spontaneous(received.pdu, rules)) return Verdict::spontaneous;
  // Without ids other functions from our unit are late answers; an id is ours alone.
  const bool ours = addressed && (fit == Fit::wrong_shape || has_ids(rules));
  return ours ? Verdict::broken : Verdict::stray;
}

}  // namespace spindle::link
