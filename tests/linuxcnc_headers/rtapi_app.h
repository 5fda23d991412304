/* Stand-in, see hal.h. */
#define MODULE_LICENSE(words) extern int stand_in_of_a_licence
#define MODULE_DESCRIPTION(words) extern int stand_in_of_a_description
#define EXPORT_SYMBOL(name) extern int stand_in_of_an_export
int rtapi_app_main(void);
void rtapi_app_exit(void);
