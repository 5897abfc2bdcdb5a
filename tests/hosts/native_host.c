/* An FMI 2.0 host in C for native units: no Python is in the process.
 *
 * Usage: native_host LIBRARY GUID STEPS STRING_REFERENCE STRING_VALUE INPUTS OUTPUTS
 * INPUTS and OUTPUTS are counts followed by value references; a STRING_REFERENCE of -1 sets no text. Two instances step
 * side by side; the state is serialised, undone and restored in between; a NaN is refused by the call that sets it.
 * Printed are the outputs of every 10th step.
 */
#include "fmi2_host.h"

int main(int argc, char **argv)
{
    unsigned read[MOST], shown[MOST];
    double fed[MOST], values[MOST], other[MOST];
    int argument = 6;
    if (argc < 8)
        return 2;
    void *library = opened(argv[1]);
    const Functions f = functions_of(library);
    int (*reset)(void *) = symbol(library, "fmi2Reset");
    const States s = states_of(library);

    const int steps = atoi(argv[3]);
    Callbacks callbacks = {logger, calloc, free, NULL, NULL};
    void *units[2];
    size_t inputs = references(&argument, argv, read), outputs = references(&argument, argv, shown);
    for (int u = 0; u < 2; u++) {
        units[u] = f.instantiate("unit", 1, argv[2], "", &callbacks, 0, 1);
        if (!units[u])
            return 5;
        for (int again = 0; again < 2; again++) {
            initialise(&f, units[u], atoi(argv[4]), argv[5]);
            if (again == 0) {
                check(f.step(units[u], 0.0, 0.01, 1), OK, "fmi2DoStep before fmi2Reset");
                check(reset(units[u]), OK, "fmi2Reset");
            }
        }
    }
    for (int k = 0; k < steps; k++) {
        for (size_t i = 0; i < inputs; i++)
            fed[i] = 0.2 * sin(0.05 * k * (double)(i + 1)) + 0.1 * (double)i;
        for (int u = 0; u < 2; u++)
            check(f.set_real(units[u], read, inputs, fed), OK, "fmi2SetReal");
        if (k % 100 == 50) { /* step twice, and take both steps back through bytes */
            void *state = NULL;
            size_t size = 0;
            check(s.save(units[1], &state), OK, "fmi2GetFMUstate");
            check(s.size_of(units[1], state, &size), OK, "fmi2SerializedFMUstateSize");
            char *bytes = malloc(size);
            check(s.serialise(units[1], state, bytes, size), OK, "fmi2SerializeFMUstate");
            check(f.step(units[1], 0.01 * k, 0.01, 1), OK, "fmi2DoStep");
            check(f.step(units[1], 0.01 * (k + 1), 0.01, 1), OK, "fmi2DoStep");
            check(s.release(units[1], &state), OK, "fmi2FreeFMUstate");
            check(s.deserialise(units[1], bytes, size, &state), OK, "fmi2DeSerializeFMUstate");
            check(s.restore(units[1], state), OK, "fmi2SetFMUstate");
            check(messages, 0, "the log");
            if (size > 40) { /* cut off: the bytes are refused, and nothing changes */
                void *cut = NULL;
                check(s.deserialise(units[1], bytes, size - 20, &cut), OK, "fmi2DeSerializeFMUstate");
                check(s.restore(units[1], cut), DISCARD, "fmi2SetFMUstate of bytes that are cut off");
                check(s.release(units[1], &cut), OK, "fmi2FreeFMUstate");
                messages = 0;
            }
            free(bytes);
            check(s.release(units[1], &state), OK, "fmi2FreeFMUstate");
        }
        check(f.step(units[0], 0.01 * k, 0.01, 1), OK, "fmi2DoStep");
        check(f.step(units[1], 0.01 * k, 0.01, 1), OK, "fmi2DoStep");
        check(f.get_real(units[0], shown, outputs, values), OK, "fmi2GetReal");
        check(f.get_real(units[1], shown, outputs, other), OK, "fmi2GetReal");
        check(memcmp(values, other, outputs * sizeof *values), 0, "the comparison of two instances");
        if (k % 10 == 0)
            for (size_t i = 0; i < outputs; i++)
                printf("%.17g\n", values[i]);
    }
    check(messages, 0, "the log");
    if (inputs > 0) {
        double good = fed[0], bad = NAN;
        check(f.set_real(units[0], read, 1, &bad), DISCARD, "fmi2SetReal of a NaN");
        check(f.step(units[0], 0.01 * steps, 0.01, 1), DISCARD, "fmi2DoStep after a NaN");
        check(f.set_real(units[0], read, 1, &good), OK, "fmi2SetReal after a NaN");
        check(f.step(units[0], 0.01 * steps, 0.01, 1), OK, "fmi2DoStep after a good value");
        check(messages, 2, "the log of the NaN");
    }
    check(f.step(units[0], 0.0, -1.0, 1), DISCARD, "fmi2DoStep backwards");
    check(f.setup(units[0], 0, 0.0, 0.0, 0, 0.0), FAILURE, "fmi2SetupExperiment while stepping");
    if (f.instantiate("unit", 1, "{no GUID}", "", &callbacks, 0, 1))
        return 6;
    for (int u = 0; u < 2; u++) {
        check(f.terminate(units[u]), OK, "fmi2Terminate");
        f.release(units[u]);
    }
    return 0;
}
