// What spindle asks of libmodbus, for a static program: Debian has no static libmodbus. A serial
// port is opened and set as libmodbus 3.1.6 does it; src/posix/serial.cpp then checks by itself
// what the port has become.
#include <fcntl.h>
#include <modbus.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <utility>

struct _modbus {
  std::string path;
  speed_t speed;
  char parity;
  int stop_bits;
  int port = -1;
  termios before = {};
};

namespace {

constexpr std::array<std::pair<int, speed_t>, 17> speeds = {{{1200, B1200},
                                                             {2400, B2400},
                                                             {4800, B4800},
                                                             {9600, B9600},
                                                             {19200, B19200},
                                                             {38400, B38400},
                                                             {57600, B57600},
                                                             {115200, B115200},
                                                             {230400, B230400},
                                                             {460800, B460800},
                                                             {500000, B500000},
                                                             {576000, B576000},
                                                             {921600, B921600},
                                                             {1000000, B1000000},
                                                             {1152000, B1152000},
                                                             {1500000, B1500000},
                                                             {2000000, B2000000}}};

termios settings_of(const modbus_t& context) {
  termios settings = {};
  ::cfsetispeed(&settings, context.speed);
  ::cfsetospeed(&settings, context.speed);
  settings.c_cflag |= CREAD | CLOCAL | CS8;
  if (context.stop_bits == 2) settings.c_cflag |= CSTOPB;
  if (context.parity != 'N') {
    settings.c_cflag |= PARENB;
    settings.c_iflag |= INPCK;
  }
  if (context.parity == 'O') settings.c_cflag |= PARODD;
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  return settings;
}

}  // namespace

extern "C" {

// No version of libmodbus is part of the program.
const unsigned int libmodbus_version_major = 0;
const unsigned int libmodbus_version_minor = 0;
const unsigned int libmodbus_version_micro = 0;

modbus_t* modbus_new_rtu(const char* device, int baud, char parity, int data_bit, int stop_bit) {
  for (const auto& [rate, speed] : speeds) {
    if (rate == baud && data_bit == 8) {
      return new modbus_t{.path = device, .speed = speed, .parity = parity, .stop_bits = stop_bit};
    }
  }
  errno = EINVAL;
  return nullptr;
}

int modbus_connect(modbus_t* context) {
  context->port = ::open(context->path.c_str(), O_RDWR | O_NOCTTY | O_NDELAY | O_EXCL | O_CLOEXEC);
  if (context->port < 0) return -1;
  const termios settings = settings_of(*context);
  if (::tcgetattr(context->port, &context->before) == 0 &&
      ::tcsetattr(context->port, TCSANOW, &settings) == 0) {
    return 0;
  }
  const int failure = errno;
  ::close(std::exchange(context->port, -1));
  errno = failure;
  return -1;
}

int modbus_get_socket(modbus_t* context) { return context->port; }

void modbus_close(modbus_t* context) {
  if (context == nullptr || context->port < 0) return;
  ::tcsetattr(context->port, TCSANOW, &context->before);
  ::close(std::exchange(context->port, -1));
}

void modbus_free(modbus_t* context) { delete context; }
}
