#include "posix/baud.hpp"

#include <algorithm>
#include <array>

namespace spindle::posix {
namespace {

struct Rate {
  unsigned baud;
  speed_t speed;
};
constexpr std::array rates = {
    Rate{300, B300},         Rate{600, B600},         Rate{1200, B1200},
    Rate{2400, B2400},       Rate{4800, B4800},       Rate{9600, B9600},
    Rate{19200, B19200},     Rate{38400, B38400},     Rate{57600, B57600},
    Rate{115200, B115200},   Rate{230400, B230400},   Rate{460800, B460800},
    Rate{500000, B500000},   Rate{576000, B576000},   Rate{921600, B921600},
    Rate{1000000, B1000000}, Rate{1152000, B1152000}, Rate{1500000, B1500000},
    Rate{2000000, B2000000}, Rate{2500000, B2500000}, Rate{3000000, B3000000},
    Rate{3500000, B3500000}, Rate{4000000, B4000000}};

}  // namespace

std::optional<speed_t> speed_of(unsigned baud) {
  const auto* const rate = std::find_if(rates.begin(), rates.end(),
                                        [baud](const Rate& row) { return row.baud == baud; });
  return rate == rates.end() ? std::nullopt : std::optional(rate->speed);
}

}  // namespace spindle::posix
