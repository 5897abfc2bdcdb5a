/* An FMI 2.0 host in C, as a tool without Python is: it loads a unit, steps it and prints its outputs after each step.
 *
 * Usage: c_host LIBRARY RESOURCES_URI GUID STEPS SAVES STRING_REFERENCE STRING_VALUE PORT_REFERENCE INPUTS OUTPUTS
 * INPUTS and OUTPUTS are counts followed by value references; a STRING_REFERENCE of -1 sets no text, a PORT_REFERENCE
 * sets the port 0, any free one. If SAVES is not 0, step 25 begins from the unit's state, serialised and restored.
 * After the steps it sends a NaN, expects fmi2Discard from the next step, then a good value and expects fmi2OK.
 */
#include "fmi2_host.h"

#include <unistd.h>

int main(int argc, char **argv)
{
    unsigned read[MOST], shown[MOST];
    double fed[MOST], values[MOST];
    int argument = 9;
    if (argc < 11)
        return 2;
    void *library = opened(argv[1]);
    const Functions f = functions_of(library);
    const States s = states_of(library);
    int (*set_integer)(void *, const unsigned *, size_t, const int *) = symbol(library, "fmi2SetInteger");
    const int steps = atoi(argv[4]), saves = atoi(argv[5]), port = atoi(argv[8]), any = 0;

    Callbacks callbacks = {logger, calloc, free, NULL, NULL};
    void *unit = f.instantiate("unit", 1, argv[3], argv[2], &callbacks, 0, 1);
    if (!unit)
        return 5;
    if (port >= 0) {
        const unsigned place = (unsigned)port;
        check(set_integer(unit, &place, 1, &any), OK, "fmi2SetInteger");
    }
    initialise(&f, unit, atoi(argv[6]), argv[7]);
    size_t inputs = references(&argument, argv, read), outputs = references(&argument, argv, shown);
    for (int k = 0; k < steps; k++) {
        if (k == 25 && saves) { /* what follows must be as if nothing had happened */
            void *state = NULL, *back = NULL;
            size_t size = 0;
            check(s.save(unit, &state), OK, "fmi2GetFMUstate");
            check(s.size_of(unit, state, &size), OK, "fmi2SerializedFMUstateSize");
            char *bytes = malloc(size);
            check(s.serialise(unit, state, bytes, size), OK, "fmi2SerializeFMUstate");
            check(s.deserialise(unit, bytes, size, &back), OK, "fmi2DeSerializeFMUstate");
            check(s.restore(unit, back), OK, "fmi2SetFMUstate");
            free(bytes);
        }
        for (size_t i = 0; i < inputs; i++) /* ramps, then sines */
            fed[i] = k < 50 ? 0.01 * k * (double)(i + 1) : 0.4 * sin(0.05 * k * (double)(i + 1));
        check(f.set_real(unit, read, inputs, fed), OK, "fmi2SetReal");
        check(f.step(unit, 0.01 * k, 0.01, 1), OK, "fmi2DoStep");
        check(f.get_real(unit, shown, outputs, values), OK, "fmi2GetReal");
        for (size_t i = 0; i < outputs; i++)
            printf("%.17g\n", values[i]);
    }
    check(messages, 0, "the log");
    if (inputs > 0) {
        double good = fed[0], bad = NAN;
        check(f.set_real(unit, read, 1, &bad), OK, "fmi2SetReal of a NaN");
        check(f.step(unit, 0.01 * steps, 0.01, 1), DISCARD, "fmi2DoStep after a NaN");
        check(f.step(unit, 0.01 * steps, 0.01, 1), DISCARD, "fmi2DoStep after a NaN, again");
        check(f.set_real(unit, read, 1, &good), OK, "fmi2SetReal after a NaN");
        check(f.step(unit, 0.01 * steps, 0.01, 1), OK, "fmi2DoStep after a good value");
        check(messages, 3, "the log of the NaN");
    }
    check(f.terminate(unit), OK, "fmi2Terminate");
    f.release(unit);
    fflush(stdout);
    _exit(0); /* pythonfmu's binary may abort while the interpreter ends */
}
