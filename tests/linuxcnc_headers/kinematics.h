/* Stand-in, see hal.h. */
typedef struct { double x, y, z; } PmCartesian;
typedef struct { PmCartesian tran; double a, b, c, u, v, w; } EmcPose;
typedef enum { KINEMATICS_IDENTITY = 1, KINEMATICS_BOTH = 4 } KINEMATICS_TYPE;
typedef unsigned long KINEMATICS_FORWARD_FLAGS, KINEMATICS_INVERSE_FLAGS;
int kinematicsForward(
    const double *joints, EmcPose *world, const KINEMATICS_FORWARD_FLAGS *forward, KINEMATICS_INVERSE_FLAGS *inverse);
int kinematicsInverse(
    const EmcPose *world, double *joints, const KINEMATICS_INVERSE_FLAGS *inverse, KINEMATICS_FORWARD_FLAGS *forward);
KINEMATICS_TYPE kinematicsType(void);
#define KINS_NOT_SWITCHABLE extern int stand_in_of_switches;
