/* A proportional controller of position as an FMU 2.0 for co-simulation, on the headers of the standard.

   u = k_p (reference - x), computed at the start of a step and held during it, as a sampled drive does. */

#include <stdlib.h>

#include "fmi2Functions.h"

enum { REFERENCE, X, U, K_P, COUNT }; /* the value references in controller.xml */

static const fmi2Real defaults[COUNT] = {[K_P] = 100.0};

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2Reset(fmi2Component c)
{
    for (int i = 0; i < COUNT; i++)
        ((fmi2Real *)c)[i] = defaults[i];
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String resources,
                              const fmi2CallbackFunctions *calls, fmi2Boolean visible, fmi2Boolean logged)
{
    fmi2Component c = type == fmi2CoSimulation ? malloc(sizeof defaults) : NULL;
    (void)name, (void)token, (void)resources, (void)calls, (void)visible, (void)logged;
    if (c)
        fmi2Reset(c);
    return c;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= COUNT)
            return fmi2Error;
        value[i] = ((fmi2Real *)c)[vr[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= COUNT || vr[i] == U)
            return fmi2Error;
        ((fmi2Real *)c)[vr[i]] = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean final)
{
    fmi2Real *own = c;
    (void)t, (void)h, (void)final;
    own[U] = own[K_P] * (own[REFERENCE] - own[X]);
    return fmi2OK;
}

/* The standard asks for every function. These have nothing to do, or nothing to give. */
#define ANSWER(name, answer, ...) fmi2Status name(fmi2Component c __VA_ARGS__) { (void)c; return answer; }
#define REFERENCES , const fmi2ValueReference vr[], size_t n
#pragma GCC diagnostic ignored "-Wunused-parameter"
ANSWER(fmi2SetDebugLogging, fmi2OK, , fmi2Boolean on, size_t n, const fmi2String categories[])
ANSWER(fmi2SetupExperiment, fmi2OK, , fmi2Boolean tolerant, fmi2Real tolerance, fmi2Real start, fmi2Boolean ends, fmi2Real stop)
ANSWER(fmi2EnterInitializationMode, fmi2OK)
ANSWER(fmi2ExitInitializationMode, fmi2OK)
ANSWER(fmi2Terminate, fmi2OK)
ANSWER(fmi2GetInteger, fmi2Error, REFERENCES, fmi2Integer value[])
ANSWER(fmi2GetBoolean, fmi2Error, REFERENCES, fmi2Boolean value[])
ANSWER(fmi2GetString, fmi2Error, REFERENCES, fmi2String value[])
ANSWER(fmi2SetInteger, fmi2Error, REFERENCES, const fmi2Integer value[])
ANSWER(fmi2SetBoolean, fmi2Error, REFERENCES, const fmi2Boolean value[])
ANSWER(fmi2SetString, fmi2Error, REFERENCES, const fmi2String value[])
ANSWER(fmi2GetFMUstate, fmi2Error, , fmi2FMUstate *state)
ANSWER(fmi2SetFMUstate, fmi2Error, , fmi2FMUstate state)
ANSWER(fmi2FreeFMUstate, fmi2Error, , fmi2FMUstate *state)
ANSWER(fmi2SerializedFMUstateSize, fmi2Error, , fmi2FMUstate state, size_t *size)
ANSWER(fmi2SerializeFMUstate, fmi2Error, , fmi2FMUstate state, fmi2Byte bytes[], size_t size)
ANSWER(fmi2DeSerializeFMUstate, fmi2Error, , const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
ANSWER(fmi2GetDirectionalDerivative, fmi2Error, REFERENCES, const fmi2ValueReference known[], size_t of_known, const fmi2Real seed[], fmi2Real value[])
ANSWER(fmi2SetRealInputDerivatives, fmi2Error, REFERENCES, const fmi2Integer order[], const fmi2Real value[])
ANSWER(fmi2GetRealOutputDerivatives, fmi2Error, REFERENCES, const fmi2Integer order[], fmi2Real value[])
ANSWER(fmi2CancelStep, fmi2Error)
ANSWER(fmi2GetStatus, fmi2Discard, , const fmi2StatusKind kind, fmi2Status *value)
ANSWER(fmi2GetRealStatus, fmi2Discard, , const fmi2StatusKind kind, fmi2Real *value)
ANSWER(fmi2GetIntegerStatus, fmi2Discard, , const fmi2StatusKind kind, fmi2Integer *value)
ANSWER(fmi2GetBooleanStatus, fmi2Discard, , const fmi2StatusKind kind, fmi2Boolean *value)
ANSWER(fmi2GetStringStatus, fmi2Discard, , const fmi2StatusKind kind, fmi2String *value)
