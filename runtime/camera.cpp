#include "runtime/camera.h"
