/* An FMI 2.0 host in C, as a tool without Python is: it loads a unit, steps it 50 times and prints its outputs.
 *
 * Usage: c_host LIBRARY RESOURCES_URI GUID STRING_REFERENCE STRING_VALUE INPUTS OUTPUTS
 * INPUTS and OUTPUTS are counts followed by value references; a STRING_REFERENCE of -1 sets no text.
 * After the steps it sends a NaN, expects fmi2Discard from the next step, then a good value and expects fmi2OK.
 */
#include "fmi2_host.h"

#include <unistd.h>

int main(int argc, char **argv)
{
    unsigned read[MOST], shown[MOST];
    double fed[MOST], values[MOST];
    int argument = 6;
    if (argc < 8)
        return 2;
    void *library = opened(argv[1]);
    const Functions f = functions_of(library);

    Callbacks callbacks = {logger, calloc, free, NULL, NULL};
    void *unit = f.instantiate("unit", 1, argv[3], argv[2], &callbacks, 0, 1);
    if (!unit)
        return 5;
    initialise(&f, unit, atoi(argv[4]), argv[5]);
    size_t inputs = references(&argument, argv, read), outputs = references(&argument, argv, shown);
    for (int k = 0; k < 50; k++) {
        for (size_t i = 0; i < inputs; i++)
            fed[i] = 0.01 * k * (double)(i + 1);
        check(f.set_real(unit, read, inputs, fed), OK, "fmi2SetReal");
        check(f.step(unit, 0.01 * k, 0.01, 1), OK, "fmi2DoStep");
    }
    check(f.get_real(unit, shown, outputs, values), OK, "fmi2GetReal");
    check(messages, 0, "the log");
    for (size_t i = 0; i < outputs; i++)
        printf("%.17g\n", values[i]);
    if (inputs > 0) {
        double good = fed[0], bad = NAN;
        check(f.set_real(unit, read, 1, &bad), OK, "fmi2SetReal of a NaN");
        check(f.step(unit, 0.5, 0.01, 1), DISCARD, "fmi2DoStep after a NaN");
        check(f.step(unit, 0.5, 0.01, 1), DISCARD, "fmi2DoStep after a NaN, again");
        check(f.set_real(unit, read, 1, &good), OK, "fmi2SetReal after a NaN");
        check(f.step(unit, 0.5, 0.01, 1), OK, "fmi2DoStep after a good value");
        check(messages, 3, "the log of the NaN");
    }
    check(f.terminate(unit), OK, "fmi2Terminate");
    f.release(unit);
    fflush(stdout);
    _exit(0); /* pythonfmu's binary may abort while the interpreter ends */
}
