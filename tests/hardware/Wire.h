#include "arduino_stub.h"
